// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/toy_scene.hpp"

#include <fmt/format.h>

#include <cmath>

namespace orbitfuse::nerf::test {

Dataset toy_scene(Modality modality, int views, double scale, int pixels) {
  Dataset data;
  data.modality = modality;
  const double ball = 0.4 * scale;
  for (int i = 0; i < views; ++i) {
    const double a = 2 * 3.14159265358979 * i / views;
    const Eigen::Vector3d eye(scale * std::cos(a), scale * std::sin(a), 0.3 * scale * (i % 2));
    Eigen::Matrix3d world_from_cam;
    world_from_cam.col(2) = -eye.normalized();
    world_from_cam.col(0) = world_from_cam.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
    world_from_cam.col(1) = world_from_cam.col(2).cross(world_from_cam.col(0));
    TrainingView view;
    view.name = fmt::format("{:03d}.png", i);
    view.camera = Camera::from_fov(pixels, pixels, 60);
    view.cam_from_world.rotation = Eigen::Quaterniond(world_from_cam.transpose());
    view.cam_from_world.translation = -(world_from_cam.transpose() * eye);
    view.image.create(pixels, pixels, modality == Modality::visible ? CV_32FC3 : CV_32FC1);
    for (int y = 0; y < pixels; ++y)
      for (int x = 0; x < pixels; ++x) {
        const Eigen::Vector3d d =
            (world_from_cam * view.camera.ray_of({x + 0.5, y + 0.5})).normalized();
        const double along = -eye.dot(d), gap = along * along - eye.squaredNorm() + ball * ball;
        Eigen::Vector3d p = Eigen::Vector3d::Zero();
        if (gap > 0) p = (eye + (along - std::sqrt(gap)) * d) / ball;
        if (modality == Modality::visible)
          view.image.at<cv::Vec3f>(y, x) =
              gap > 0 ? cv::Vec3f(static_cast<float>(0.5 + 0.4 * p.x()),
                                  static_cast<float>(0.5 + 0.4 * p.y()),
                                  static_cast<float>(0.5 + 0.4 * std::sin(6 * p.z())))
                      : cv::Vec3f(0.1f, 0.2f, 0.3f);
        else
          view.image.at<float>(y, x) = gap > 0 ? static_cast<float>(300 + 5 * p.z()) : 290.0f;
      }
    data.views.push_back(view);
  }
  return data;
}

std::vector<DepthMap> toy_depth(const Dataset& data, double scale) {
  std::vector<DepthMap> maps;
  const double ball = 0.4 * scale;
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    const TrainingView& view = data.views[i];
    const Eigen::Vector3d eye = camera_center(view.cam_from_world);
    DepthMap map{static_cast<int>(i), view.camera, {}, {}, {}};
    map.depth.create(view.camera.height, view.camera.width, CV_32FC1);
    for (int y = 0; y < map.depth.rows; ++y)
      for (int x = 0; x < map.depth.cols; ++x) {
        const Eigen::Vector3d ray = view.camera.ray_of({x + 0.5, y + 0.5});
        const Eigen::Vector3d d = view.cam_from_world.rotation.conjugate() * ray;
        const double a = d.squaredNorm(), b = eye.dot(d),
                     gap = b * b - a * (eye.squaredNorm() - ball * ball);
        map.depth.at<float>(y, x) =
            gap > 0 ? static_cast<float>((-b - std::sqrt(gap)) / a) : std::nanf("");
      }
    maps.push_back(std::move(map));
  }
  return maps;
}

TrainOptions toy_options(Modality modality, int iterations) {
  TrainOptions options = preset(default_preset(modality)).value();
  options.iterations = iterations;
  options.eval_count = 2;
  options.log2_table = 12;
  options.max_resolution = 128;
  options.occupancy_resolution = 32;
  options.samples_per_step = 4096;
  options.sh_degree = 0;  // a toy has no highlights, and few views must not explain it by them
  return options;
}

}  // namespace orbitfuse::nerf::test
