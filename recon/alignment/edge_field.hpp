// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <opencv2/core.hpp>

#include "core/geometry/camera.hpp"
#include "core/numeric/bilinear.hpp"

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
  const auto place = place_among<float>(field.cols, field.rows, static_cast<float>(x - 0.5),
                                        static_cast<float>(y - 0.5));
  if (!place) return {};
  return blended(*place,
                 [&](int row, int column) { return field.ptr<std::complex<float>>(row)[column]; });
}

/// Agreement of an edge with the given normal: strength * cos(2 angle between).
inline double agreement(std::complex<float> field, const Eigen::Vector2d& normal) {
  const double c = normal.x() * normal.x() - normal.y() * normal.y();
  const double s = 2 * normal.x() * normal.y();
  return static_cast<double>(field.real()) * c + static_cast<double>(field.imag()) * s;
}

}  // namespace orbitfuse
