// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/quarter_turn.hpp"

#include <cmath>
#include <numbers>
#include <utility>

namespace orbitfuse {
namespace {

/// A pixel (x, y) of an image h pixels high comes to (h - y, x).
Camera turned_once(const Camera& camera) {
  Camera result = camera.without_distortion();
  std::swap(result.width, result.height);
  std::swap(result.fx, result.fy);
  result.cx = camera.height - camera.cy;
  result.cy = camera.cx;
  return result;
}

}  // namespace

cv::Mat upright(QuarterTurn turn, const cv::Mat& image) {
  constexpr int codes[] = {cv::ROTATE_90_CLOCKWISE, cv::ROTATE_180, cv::ROTATE_90_COUNTERCLOCKWISE};
  if (turn.clockwise == 0) return image;
  cv::Mat result;
  cv::rotate(image, result, codes[turn.clockwise - 1]);
  return result;
}

Camera upright(QuarterTurn turn, const Camera& taken) {
  Camera result = taken.without_distortion();
  for (int i = 0; i < turn.clockwise; ++i) result = turned_once(result);
  return result;
}

PosedView as_taken(QuarterTurn turn, const PosedView& upright_view) {
  const Eigen::AngleAxisd back(-turn.clockwise * std::numbers::pi / 2, Eigen::Vector3d::UnitZ());
  const Rigid3d taken_from_upright{Eigen::Quaterniond(back), Eigen::Vector3d::Zero()};
  return {upright_view.name, upright(turn.back(), upright_view.camera),
          taken_from_upright * upright_view.cam_from_world};
}

}  // namespace orbitfuse
