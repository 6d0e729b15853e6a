// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>

namespace orbitfuse {

/// Focal length from views of a plane: with H = [h1 h2 h3] (plane to image, origin at the principal
/// point), square pixels demand h1' w h2 = 0 and h1' w h1 = h2' w h2 with w = diag(1/f^2, 1/f^2, 1)
/// (Zhang, PAMI 2000). Two linear equations in 1/f^2 a view, summed over views; frontal views add
/// next to nothing by themselves.
class FocalEstimate {
 public:
  /// `image_from_plane` with image coordinates relative to the principal point, in pixels.
  void add(const Eigen::Matrix3d& image_from_plane, double image_width_px);
  /// Nothing until the views determine it (a tilt of some 15 degrees); within 0.3..10 image widths.
  std::optional<double> focal_px() const;

 private:
  double sum_bb_ = 0, sum_ab_ = 0, width_px_ = 0;
};

}  // namespace orbitfuse
