// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "recon/alignment/scene_renderer.hpp"

namespace orbitfuse {

struct SeenOfView {
  double surface = 0;  ///< share of the pixels that show something at all
  double seen = 0;     ///< share of these that a recorded view saw from about there
};

/// Whether recorded views saw what a new view shows. A field answers from everywhere: inside of the
/// object, below the ground and where nobody looked it invents.
class SeenBefore {
 public:
  /// `scene` is what the recorded views, which share its world, made; it is asked for one small
  /// render a view. Errors: the renderer's.
  static Result<SeenBefore> of(const SceneRenderer& scene, std::vector<PosedView> recorded);

  /// Of a view without lens distortion; `depth` (CV_32FC1 of its camera's size, along the optical
  /// axis, NaN where there is nothing) is what it shows.
  SeenOfView share_of(const PosedView& view, const cv::Mat& depth) const;

 private:
  struct Recorded {
    PosedView view;
    Eigen::Vector3d center;
    cv::Mat depth;
  };
  bool saw(const Eigen::Vector3d& point, const Eigen::Vector3d& seen_from) const;

  std::vector<Recorded> recorded_;
};

}  // namespace orbitfuse
