// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/undistorted.hpp"

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

cv::Mat straightened(const cv::Mat& image, const Camera& camera, double k1) {
  if (k1 == 0) return image;
  Camera bent = camera;
  bent.k1 += k1;
  return undistorted(image, bent, camera);
}

}  // namespace orbitfuse
