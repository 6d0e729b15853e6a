// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"

namespace orbitfuse::depth::test {

/// A patterned floor z = 0, seen by cameras on an arc that look at the centre.
struct World {
  Reconstruction model;
  std::vector<cv::Mat> images;
  std::vector<cv::Mat> truth;  ///< z along the optical axis
};

inline double pattern(const Eigen::Vector3d& p) {
  double v = 0;
  for (int i = 1; i <= 4; ++i)
    v += std::sin((7 + 5 * i) * p.x() + 3 * i) *
         std::cos((6 + 4 * i) * p.y() + 2 * i + (9 + i) * p.z());
  return 128 + 28 * v;
}

inline World arc(int views, double step_deg, double scale = 1, int width = 160, double k1 = 0) {
  World world;
  for (int i = 0; i < views; ++i) {
    const double a = step_deg * (i - 0.5 * (views - 1)) * 3.14159265358979 / 180;
    const Eigen::Vector3d eye = scale * Eigen::Vector3d(2 * std::sin(a), -2 * std::cos(a), 2);
    Eigen::Matrix3d axes;  // columns: camera axes in the world
    axes.col(2) = -eye.normalized();
    axes.col(0) = axes.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0));
    PosedView view;
    view.name = std::to_string(i);
    view.camera = Camera::from_fov(width, width * 3 / 4, 40);
    view.camera.k1 = k1;
    view.cam_from_world.rotation = Eigen::Quaterniond(axes.transpose());
    view.cam_from_world.translation = -(axes.transpose() * eye);
    cv::Mat image(view.camera.height, width, CV_8UC1), depth(view.camera.height, width, CV_32FC1);
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < width; ++x) {
        const Eigen::Vector3d d = axes * view.camera.ray_of({x + 0.5, y + 0.5});
        const double t = -eye.z() / d.z();
        image.at<std::uint8_t>(y, x) =
            cv::saturate_cast<std::uint8_t>(pattern((eye + t * d) / scale));
        depth.at<float>(y, x) = static_cast<float>(t);  // the ray's z is 1
      }
    world.images.push_back(image);
    world.truth.push_back(depth);
    world.model.views.push_back(view);
  }
  return world;
}

}  // namespace orbitfuse::depth::test
