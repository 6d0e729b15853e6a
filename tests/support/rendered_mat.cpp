// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/rendered_mat.hpp"

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace orbitfuse::test {

cv::Mat printed_mat(const std::vector<MatRectangle>& black, double size_m, double pixel_m) {
  const int side = static_cast<int>(std::lround(size_m / pixel_m));
  cv::Mat mat(side, side, CV_8UC1, cv::Scalar(230));
  const auto px = [&](double metres) { return static_cast<int>(std::lround(metres / pixel_m)); };
  for (const MatRectangle& r : black) {
    const int left = px(r.left + size_m / 2), right = px(r.left + r.width + size_m / 2);
    const int top = px(size_m / 2 - r.bottom - r.height), bottom = px(size_m / 2 - r.bottom);
    mat(cv::Range(std::max(0, top), std::min(side, bottom)),
        cv::Range(std::max(0, left), std::min(side, right))) = 25;
  }
  return mat;
}

Rigid3d orbit_pose(double azimuth_deg, double elevation_deg, double distance_m) {
  const double a = azimuth_deg * std::numbers::pi / 180, e = elevation_deg * std::numbers::pi / 180;
  const Eigen::Vector3d eye = distance_m * Eigen::Vector3d(std::cos(e) * std::cos(a),
                                                           std::cos(e) * std::sin(a), std::sin(e));
  const Eigen::Vector3d z = -eye.normalized(), x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d r;
  r << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond q(r);
  return {q, -(q * eye)};
}

cv::Mat view_of_mat(const cv::Mat& mat, double size_m, const Camera& camera,
                    const Rigid3d& cam_from_mat) {
  // Each pixel is a mean of 3 x 3 rays cut with the mat's plane.
  constexpr int n = 3;
  const Eigen::Vector3d eye = camera_center(cam_from_mat);
  const Eigen::Matrix3d world_from_cam = cam_from_mat.rotation.conjugate().toRotationMatrix();
  cv::Mat image(camera.height, camera.width, CV_8UC1);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      int sum = 0;
      for (int s = 0; s < n * n; ++s) {
        const Eigen::Vector3d in_camera((x + (s % n + 0.5) / n - camera.cx) / camera.fx,
                                        (y + (s / n + 0.5) / n - camera.cy) / camera.fy, 1);
        const Eigen::Vector3d ray = world_from_cam * in_camera;
        int value = 120;
        if (ray.z() < 0) {
          const Eigen::Vector3d p = eye - eye.z() / ray.z() * ray;
          const int u = static_cast<int>(std::floor((p.x() / size_m + 0.5) * mat.cols));
          const int v = static_cast<int>(std::floor((0.5 - p.y() / size_m) * mat.rows));
          if (u >= 0 && u < mat.cols && v >= 0 && v < mat.rows) value = mat.at<std::uint8_t>(v, u);
        }
        sum += value;
      }
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(sum / (n * n));
    }
  }
  return image;
}

}  // namespace orbitfuse::test
