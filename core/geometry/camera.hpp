// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/result.hpp"

namespace orbitfuse {

/// A pinhole camera with the OpenCV distortion of COLMAP's OPENCV model.
/// Pixels: the centre of the top-left pixel is (0.5, 0.5), as in COLMAP.
/// Camera axes: x right, y down, z forward.
struct Camera {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0;

  bool has_distortion() const { return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0; }
  /// Names the field that is not finite or out of range.
  Status validate(const std::string& where) const;

  /// Normalised undistorted (x/z, y/z) to pixels and back (the inverse iterates; NaN if it
  /// does not converge, i.e. outside the model's valid field of view).
  Eigen::Vector2d pixel_of(const Eigen::Vector2d& normalized) const;
  Eigen::Vector2d normalized_of(const Eigen::Vector2d& pixel) const;

  /// Pixel of a point in camera coordinates; NaN when z <= 0.
  Eigen::Vector2d project(const Eigen::Vector3d& x_in_cam) const;
  /// Direction (unnormalised, z = 1) of a pixel in camera coordinates.
  Eigen::Vector3d ray_of(const Eigen::Vector2d& pixel) const;

  /// The same view at another resolution.
  Camera scaled_to(int new_width, int new_height) const;
  /// The same view without distortion.
  Camera without_distortion() const;
  double horizontal_fov_deg() const;

  static Camera from_fov(int width, int height, double horizontal_fov_deg);
  bool operator==(const Camera&) const = default;
};

}  // namespace orbitfuse
