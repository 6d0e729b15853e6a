// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/geometry/point_cloud.hpp"
#include "core/geometry/transform.hpp"
#include "core/progress.hpp"
#include "core/result.hpp"

// Registration of two clouds of one object by a similarity (scale, R, t). Every length in the
// options is relative to the target's robust diameter, so that units do not matter. The paper of
// registered visible and infrared fields that figures here are compared with is named in
// fusion/metrics/metrics.hpp.
namespace orbitfuse {

struct RegistrationOptions {
  int points = 2500;                ///< per cloud after voxels; more costs time, gains little
  double max_pair_distance = 0.06;  ///< of the diameter: where coarse scoring stops counting
  double inlier_distance = 0.02;    ///< of the diameter: pairs that count as matched in the report
  double min_scale = 0.2, max_scale = 5;  ///< of target over source, after size normalisation
  double decisive_score = 0.55;   ///< the second initialiser is skipped above this two-sided score,
                                  ///< if hardly anything contradicts it and no rival comes near
  double ambiguity_ratio = 0.85;  ///< a distinct runner-up with this share of the evidence makes
                                  ///< the result ambiguous, and views decide, if there are any
  bool use_features = true;       ///< the first initialiser: fast, and enough for most pairs
  bool use_grid = true;         ///< the second: rotations x scales, where the first is not decisive
  bool filter_outliers = true;  ///< by neighbour distance, only where two populations are seen
  bool estimate_warp = true;    ///< beside the similarity, where the residuals show one: fields of
                                ///< two modalities are bent, and the largest bent patch would pull
  int restarts = 3;             ///< refinements from disturbed starts, for the spread
  std::uint32_t seed = 1;

  Status validate() const;
};

/// What became of the smooth warp beside the similarity.
enum class WarpOutcome {
  not_asked,   ///< RegistrationOptions::estimate_warp is off
  too_little,  ///< too few points beside each other to tell
  none,        ///< the residuals show none
  found,       ///< and left out of the answer
  at_limit,    ///< left out, but as large as a warp may be: perhaps two shapes; ambiguous
  diverged,  ///< one shows, but estimating it led away from the clouds' fit: the answer is the one
             ///< without it; ambiguous
};
const char* name_of(WarpOutcome outcome);

struct RegistrationAlternative {
  Similarity3d target_from_source;
  double score = 0;       ///< two-sided, as RegistrationReport::score
  double evidence = 0;    ///< as RegistrationReport::evidence
  double view_score = 0;  ///< of the ViewScore, if there is one
  std::string origin;     ///< which initialiser found it
};

struct RegistrationReport {
  Similarity3d target_from_source;
  double score = 0;           ///< 0..1, geometric mean of both sides' truncated agreement
  double evidence = 0;        ///< 0..score: less where one cloud stands off the other's surface;
                              ///< ranks the placements, has no absolute scale
  double matching_ratio = 0;  ///< share of source points with a partner (as in that paper;
                              ///< one-sided: shrinking maximises it, so never read it alone)
  double rmse = 0;            ///< of matched pairs, target units
  double rmse_percent_of_diameter = 0;
  double overlap_source = 0, overlap_target = 0;  ///< share of each cloud near the other
  /// How far from the answer others end at most: refinements from disturbed starts, none of which
  /// estimates a warp, and the answer without it.
  double spread_rotation_deg = 0, spread_scale_percent = 0, spread_translation_percent = 0;
  WarpOutcome warp = WarpOutcome::not_asked;
  double warp_percent_of_diameter = 0;  ///< root mean square of the smooth warp found beside the
                                        ///< similarity and left out of it; 0: none was left out
  bool decided_by_views = false;        ///< between placements that geometry leaves open
  double view_score = 0;                ///< of the result, where views were asked
  bool ambiguous = false;
  std::string ambiguity;                              ///< what geometry leaves open, in words
  std::vector<RegistrationAlternative> alternatives;  ///< best first, the result not included
  std::string initialiser;
  std::vector<Skip> skips;
  double cpu_s = 0;

  std::string brief() const;
};

/// Judges a placement by how views of one field explain those of the other; higher is better, 0 is
/// no agreement. Asked only where geometry leaves more than one placement; a best score that does
/// not lead by a tenth decides nothing, and the result stays ambiguous.
using ViewScore = std::function<double(const Similarity3d& target_from_source)>;

/// Clouds in any units and frames: x_in_target = target_from_source * x_in_source. Errors: usage
/// (options), input (fewer than 20 finite points, all points in one place, on one line or plane),
/// quality (no placement brings the clouds together), cancelled. Shapes that leave a direction open
/// (sphere, cylinder) come back ambiguous.
Result<RegistrationReport> register_clouds(const PointCloud& source, const PointCloud& target,
                                           const RegistrationOptions& options,
                                           const Progress& progress,
                                           const ViewScore& view_score = {});

/// Refinement alone, from a start within a few degrees and percent (of the target's diameter).
/// Errors: register_clouds' usage and input, and usage for a start that is not finite.
Result<RegistrationReport> refine_registration(const PointCloud& source, const PointCloud& target,
                                               const Similarity3d& start,
                                               const RegistrationOptions& options);

}  // namespace orbitfuse
