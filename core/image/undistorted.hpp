// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "core/geometry/camera.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// An image taken by `from` (at its size), as `to` would have taken it from the same place; what
/// lies outside repeats the border. 8-bit or float samples, of up to four channels.
cv::Mat undistorted(const cv::Mat& image, const Camera& from, const Camera& to);

/// Input error naming the file, both sizes and what to do, unless the image has its camera's size:
/// a pose and a lens hold for pictures of the size that they were found in, and for no other.
Status check_size(const cv::Mat& image, const Camera& camera, const std::string& file);

/// A recorded photo as `to` would have taken it; the error of check_size().
Result<cv::Mat> recorded_as(const cv::Mat& photo, const Camera& from, const Camera& to,
                            const std::string& file);
/// An image as its camera would have taken it without distortion: itself where there is none.
cv::Mat straightened(const cv::Mat& image, const Camera& camera);
/// The same of a recorded photo; the error of check_size().
Result<cv::Mat> recorded_straight(const cv::Mat& photo, const Camera& camera,
                                  const std::string& file);

/// An image whose lens has this k1 (Brown) beside what `camera` says, at the camera's
/// size; the image itself where it has none.
cv::Mat straightened(const cv::Mat& image, const Camera& camera, double k1);

}  // namespace orbitfuse
