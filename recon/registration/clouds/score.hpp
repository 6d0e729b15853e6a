// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/registration/clouds/candidate.hpp"
#include "recon/registration/clouds/prepared_cloud.hpp"

namespace orbitfuse::registration {

/// Where agreement ends, in unit-frame lengths of the target (the clouds' radius is 1).
struct ScoreBounds {
  double pair = 0.12;   ///< partners further apart don't agree at all
  double plane = 0.12;  ///< nor do partners this far off each other's tangent plane
  double reach = 0.24;  ///< points above the other's surface contradict it up to here
};

struct Agreement {
  /// Geometric mean of the two sides' truncated agreement, 0..1. Each point of one cloud counts
  /// 1 - (plane distance / bound)^2, times the squared cosine between the normals, for its nearest
  /// partner in the other. Shrinking a cloud into the other raises its own side only, so the
  /// product falls: the one-way fitness of the usual pipelines is maximal there.
  double score = 0;
  /// The score times the share that is borne out: points that stand above the other cloud's
  /// surface, near it, contradict the placement; points beside it (another part of the object, a
  /// hole) don't, as clouds may overlap in part. What ranks placements.
  double evidence = 0;
};
Agreement agreement(const PreparedCloud& source, const PreparedCloud& target,
                    const std::vector<int>& source_subset, const std::vector<int>& target_subset,
                    const Similarity3d& target_from_source, const ScoreBounds& bounds);

/// Over all points.
Agreement agreement(const PreparedCloud& source, const PreparedCloud& target,
                    const Similarity3d& target_from_source, const ScoreBounds& bounds);

/// What the report says about a placement, over all points.
struct MatchFigures {
  double source_share = 0, target_share = 0;  ///< points of each within `distance` of the other
  double rmse = 0;                            ///< of those pairs, both ways, target unit lengths
};
MatchFigures match_figures(const PreparedCloud& source, const PreparedCloud& target,
                           const Similarity3d& target_from_source, double distance);

}  // namespace orbitfuse::registration
