// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <opencv2/core.hpp>

#include "core/geometry/camera.hpp"

// Sign-free gradient orientation: an edge is strength * exp(2i angle of its normal), so that the
// two sides of an edge may swap brightness between modalities. Of the cues measured on real pairs
// it was the one that never pointed to a wrong place.
namespace orbitfuse {

/// CV_32FC2 field of an image, at scale `sigma_px` of its Gaussian derivative. Strength is
/// log(1 + |gradient| / noise), scaled so that the strongest percent of pixels is 1: one hot
/// surface must not outshout all other edges. An image without contrast gives zeros.
cv::Mat orientation_field(const cv::Mat& values, double sigma_px);

/// The image at that camera's size, by area averaging.
cv::Mat reduced_to(const cv::Mat& image, const Camera& camera);

/// The field of the image at that camera's size, as renders there are compared with.
cv::Mat edges_at(const cv::Mat& image, const Camera& camera);

/// The field averaged in square cells, which blurs position and keeps orientation.
cv::Mat cell_field(const cv::Mat& field, int columns, int rows);

/// Bilinear; zero outside.
inline std::complex<float> field_at(const cv::Mat& field, double x, double y) {
  const float fx = static_cast<float>(x - 0.5), fy = static_cast<float>(y - 0.5);
  const int x0 = static_cast<int>(std::floor(fx)), y0 = static_cast<int>(std::floor(fy));
  if (x0 < 0 || y0 < 0 || x0 + 1 >= field.cols || y0 + 1 >= field.rows) return {};
  const float ax = fx - static_cast<float>(x0), ay = fy - static_cast<float>(y0);
  const auto* r0 = field.ptr<std::complex<float>>(y0) + x0;
  const auto* r1 = field.ptr<std::complex<float>>(y0 + 1) + x0;
  return (r0[0] * (1 - ax) + r0[1] * ax) * (1 - ay) + (r1[0] * (1 - ax) + r1[1] * ax) * ay;
}

/// Agreement of an edge with the given normal: strength * cos(2 angle between).
inline double agreement(std::complex<float> field, const Eigen::Vector2d& normal) {
  const double c = normal.x() * normal.x() - normal.y() * normal.y();
  const double s = 2 * normal.x() * normal.y();
  return static_cast<double>(field.real()) * c + static_cast<double>(field.imag()) * s;
}

}  // namespace orbitfuse
