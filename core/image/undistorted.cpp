// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/undistorted.hpp"

#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

namespace orbitfuse {

cv::Mat undistorted(const cv::Mat& image, const Camera& from, const Camera& to) {
  cv::Mat map(to.height, to.width, CV_32FC2), out;
  for (int y = 0; y < to.height; ++y)
    for (int x = 0; x < to.width; ++x) {
      const Eigen::Vector2d at = from.pixel_of(to.normalized_of({x + 0.5, y + 0.5}));
      map.at<cv::Vec2f>(y, x) = {static_cast<float>(at.x() - 0.5),
                                 static_cast<float>(at.y() - 0.5)};
    }
  cv::remap(image, out, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return out;
}

Status check_size(const cv::Mat& image, const Camera& camera, const std::string& file) {
  if (image.cols == camera.width && image.rows == camera.height) return {};
  return fail(ErrorKind::input, file,
              fmt::format("{}x{} pixels, its camera has {}x{}", image.cols, image.rows,
                          camera.width, camera.height),
              "frames of one camera have one size: bring the session back as the run read it, or "
              "import it again");
}

Result<cv::Mat> recorded_as(const cv::Mat& photo, const Camera& from, const Camera& to,
                            const std::string& file) {
  ORBITFUSE_TRY(check_size(photo, from, file));
  return undistorted(photo, from, to);
}

Result<cv::Mat> recorded_straight(const cv::Mat& photo, const Camera& camera,
                                  const std::string& file) {
  ORBITFUSE_TRY(check_size(photo, camera, file));
  return straightened(photo, camera);
}

cv::Mat straightened(const cv::Mat& image, const Camera& camera) {
  return camera.has_distortion() ? undistorted(image, camera, camera.without_distortion()) : image;
}

cv::Mat straightened(const cv::Mat& image, const Camera& camera, double k1) {
  if (k1 == 0) return image;
  Camera bent = camera;
  bent.k1 += k1;
  return undistorted(image, bent, camera);
}

}  // namespace orbitfuse
