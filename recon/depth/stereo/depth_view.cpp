// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/stereo/depth_view.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/image/undistorted.hpp"

namespace orbitfuse::depth {
namespace {

/// A copy with room behind the last row: the kernels read four bytes at a time.
cv::Mat padded(const cv::Mat& gray) {
  cv::Mat room(gray.rows + rows_padding, gray.cols, CV_8UC1, cv::Scalar(0));
  gray.copyTo(room.rowRange(0, gray.rows));
  return room.rowRange(0, gray.rows);
}

}  // namespace

DepthView prepare_view(const cv::Mat& image, const Camera& camera, const Rigid3d& cam_from_world,
                       const Eigen::Vector3d& scene_center, double scene_radius, int width_px) {
  cv::Mat gray = image;
  if (image.channels() == 3) cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  DepthView view;
  // As many pixels as a 4:3 map of that width: a portrait format isn't worth more.
  const double even = width_px * std::sqrt(0.75 * camera.width / camera.height);
  const int width = std::clamp(static_cast<int>(std::lround(std::min<double>(width_px, even))), 16,
                               std::max(16, camera.width));
  const int height = std::max(
      1, static_cast<int>(std::lround(static_cast<double>(camera.height) * width / camera.width)));
  Camera from = camera;
  if (width != camera.width) {
    cv::resize(gray, gray, {width, height}, 0, 0, cv::INTER_AREA);
    from = camera.scaled_to(width, height);
  }
  view.camera = from.without_distortion();
  if (from.has_distortion()) gray = undistorted(gray, from, view.camera);
  view.gray = padded(gray);
  view.world_rotation = cam_from_world.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3d center = (camera_center(cam_from_world) - scene_center) / scene_radius;
  view.translation = -(view.world_rotation * center.cast<float>());
  return view;
}

Eigen::Vector3f world_of(const DepthView& view, const Eigen::Vector2d& pixel, float depth) {
  const Eigen::Vector3f x = depth * view.camera.ray_of(pixel).cast<float>();
  return view.world_rotation.transpose() * (x - view.translation);
}

DepthView halved(const DepthView& view) {
  DepthView out = view;
  const int width = std::max(1, view.gray.cols / 2), height = std::max(1, view.gray.rows / 2);
  cv::Mat small;
  cv::resize(view.gray, small, {width, height}, 0, 0, cv::INTER_AREA);
  out.gray = padded(small);
  out.camera = view.camera.scaled_to(width, height);
  return out;
}

}  // namespace orbitfuse::depth
