// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/geometry/transform.hpp"
#include "recon/poses/sfm/feature_graph.hpp"

namespace orbitfuse {

/// One way in which two frames may stand to each other, up to the distance between them.
struct RelativePose {
  int first = 0, second = 0;
  Rigid3d second_from_first;          ///< translation of length 1
  std::vector<FeatureMatch> matches;  ///< that it explains
};

struct RelativePoseOptions {
  double max_error_px = 2;  ///< from the epipolar line, in pixels of the proxies
  /// Fewer say nothing: five points fix the geometry, and chance adds some.
  int min_inliers = 20;
  /// Repeated structure can hold more matches than the right answer: what the best one leaves over
  /// is asked for another, and the loop decides.
  int max_hypotheses = 3;
  /// Rays that meet at less than this in the median fix no direction.
  double min_parallax_deg = 1.0;
};

/// Answers for a pair's matches, the one with most matches first. `cameras`: the frames' lenses.
std::vector<RelativePose> relative_poses(const FeatureGraph& graph,
                                         const std::vector<Camera>& cameras, const ViewPair& pair,
                                         const std::vector<FeatureMatch>& matches,
                                         const RelativePoseOptions& options);
/// For its proposed matches, through the lenses as known before.
std::vector<RelativePose> relative_poses(const FeatureGraph& graph, const ViewPair& pair,
                                         const RelativePoseOptions& options);

}  // namespace orbitfuse
