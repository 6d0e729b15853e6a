// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "core/result.hpp"

// Two cameras on one body: the transform between them and the thermal lens are the same in every
// pair, so all pairs are aligned as one. No field is needed: what the thermal camera sees is what
// the visible photo of the same moment shows, turned by the rig, with depths from the sparse
// points.
namespace orbitfuse {

struct RigView {
  std::string name;          ///< of the thermal frame
  cv::Mat visible, thermal;  ///< CV_32FC1
  Camera visible_camera;
  std::vector<Eigen::Vector3d> points;  ///< scene points that the visible view shows, in its axes
};

/// RigOptions::min_held_share where somebody says that the cameras are fixed to each other: above
/// chance. Of bare walls (`arco`) half of what is found is noise: 0.47.
inline constexpr double declared_held_share = 0.4;

struct RigOptions {
  Camera thermal_lens;  ///< as known before; its size is the frames'
  /// Of the focal length; above `search_from` fields of view from 12 to 90 degrees are searched.
  double focal_relative_sigma = 0.03;
  double search_from = 0.1;
  double radial_sigma = 0.2;  ///< of k1, beside the lens' own
  /// The cameras' distance as a share of the scene's, one standard deviation: they share a housing.
  double baseline_sigma = 0.03;
  /// All edges at the best shift must agree this many times better than in a shuffled order, or the
  /// rest is not tried: rigs 2.1 to 6.9 times, pairs that were not shot at once 0.7 to 1.1 (1.5
  /// once).
  double min_search_lead = 1.2;
  /// Pairs in the right order must agree this much better, in standard errors, than wrong ones.
  double min_decisiveness = 3;
  /// And of the patches found in their thermal images, this share must lie within 2 px of where one
  /// transform has them. Rigs: 0.62 to 0.87; pairs that were not shot at once, however much alike
  /// they look (two orbits that begin 12 degrees apart and are named by one counter agree in their
  /// edges 2.4 times better than shuffled ones): 0.20 to 0.38, which is chance.
  double min_held_share = 0.48;
  /// Of the images' quarters that have some patches, at most this share may lie elsewhere by them.
  /// Ten rendered rigs 0 to 0.06, the real `arco` 0.45 (it alone chose this and
  /// declared_held_share: one scene), shuffled pairs and orbits in a counter's order 0.55 to 0.95.
  double max_elsewhere_share = 0.5;
};

struct RigPairFit {
  double agreement = 0;  ///< of the photo's edges with the thermal image's
  double control = 0;    ///< of the same photo with the thermal images of the other pairs, mean
  int found = 0;         ///< patches of the photo in the thermal image
  int matches = 0;       ///< of those, within 2 px of the rig's answer, at `judged_width_px`
  double median_px = 0;  ///< their residual
  /// Of its image, with enough patches; those whose own say that they lie elsewhere.
  int quarters = 0, quarters_elsewhere = 0;
  bool lies_elsewhere() const {
    return quarters_elsewhere >= 2 && 2 * quarters_elsewhere >= quarters;
  }
};

struct RigEstimate {
  Rigid3d thermal_from_visible;
  Camera thermal;
  std::vector<RigPairFit> pairs;
  double decisiveness = 0;            ///< standard errors between right and wrong pairs
  double agreement = 0, control = 0;  ///< of right pairs and of wrong ones, means
  double held_share = 0;              ///< matches of all found patches
  double elsewhere_share = 0;         ///< of all quarters, those that lie elsewhere; 0 of none
  static constexpr int judged_width_px = 320;
  std::string words() const;
};

/// Errors: quality (the pairs agree no better than shuffled ones; too few patches, or too many that
/// no one transform explains), cancelled.
Result<RigEstimate> estimate_rig(const std::vector<RigView>& views, const RigOptions& options,
                                 const Progress& progress);

}  // namespace orbitfuse
