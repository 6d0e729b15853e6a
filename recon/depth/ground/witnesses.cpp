// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/ground/witnesses.hpp"

#include <Eigen/Dense>
#include <cmath>

namespace orbitfuse::depth {
namespace {

/// Gray levels by which two views may differ in one place, exposure included.
constexpr int alike = 14;

}  // namespace

bool Witnesses::agree(std::size_t own, cv::Point pixel, float z) const {
  const DepthView& view = views_[own];
  const Eigen::Vector3f ray = view.world_rotation.transpose() *
                              view.camera.ray_of({pixel.x + 0.5, pixel.y + 0.5}).cast<float>();
  const bool sky = std::isinf(z);
  const int gray = gray_[own].at<std::uint8_t>(pixel);
  int alike_views = 0, others = 0;
  for (std::size_t k = 0; k < views_.size(); ++k) {
    if (k == own) continue;
    const Eigen::Vector3f there =
        sky ? Eigen::Vector3f(views_[k].world_rotation * ray)
            : Eigen::Vector3f(views_[k].world_rotation * (view.center() + z * ray) +
                              views_[k].translation);
    if (!(there.z() > 1e-3f)) continue;
    const Eigen::Vector2d at = views_[k].camera.project(there.cast<double>());
    const cv::Mat& shown = gray_[k];
    if (!(at.x() >= 0 && at.y() >= 0 && at.x() < shown.cols && at.y() < shown.rows)) continue;
    const int x = static_cast<int>(at.x()), y = static_cast<int>(at.y());
    if (obstacles_[k].at<float>(y, x) < (sky ? nothing : hides * there.z())) continue;
    const bool like = std::abs(shown.at<std::uint8_t>(y, x) - gray) <= alike;
    ++(like ? alike_views : others);
  }
  return alike_views > others;
}

}  // namespace orbitfuse::depth
