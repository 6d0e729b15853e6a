// SPDX-License-Identifier: BSD-3-Clause
#include "app/planning/machine_speed.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "recon/nerf/nerf.hpp"

namespace orbitfuse::planning {
namespace {

constexpr int views = 4, warm_up_steps = 60, steps = 240;
/// Of a step on noise, where stage_s() was measured.
constexpr double reference_step_s = 2.7e-3;
/// Networks' tiles (AMX) are half of what tells processors apart: a step takes an EPYC 1.6 times
/// the reference's, a stage 1.0 to 1.5 (docs/notes/planner.md). More than that is the machine.
constexpr double most_of_tiles = 2;

/// Cameras round a ball of noise.
nerf::Dataset noise() {
  nerf::Dataset data;
  data.modality = Modality::visible;
  cv::RNG random(1);
  for (int i = 0; i < views; ++i) {
    nerf::TrainingView view;
    view.name = std::to_string(i);
    view.camera.width = 96;
    view.camera.height = 72;
    view.camera.fx = view.camera.fy = 96;
    view.camera.cx = 48;
    view.camera.cy = 36;
    const double turn = 2 * std::numbers::pi * i / views;
    view.cam_from_world =
        Rigid3d{Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY())),
                Eigen::Vector3d(0, 0, 3)};
    view.image.create(view.camera.height, view.camera.width, CV_32FC3);
    random.fill(view.image, cv::RNG::UNIFORM, 0.0, 1.0);
    data.views.push_back(std::move(view));
  }
  return data;
}

}  // namespace

double stage_slowness(double step_slowness) {
  const double bounded = std::clamp(step_slowness, 1 / most_of_tiles, most_of_tiles);
  return std::sqrt(bounded) * step_slowness / bounded;
}

double measured_slowness() {
  auto options = nerf::preset(nerf::default_preset(Modality::visible));
  if (!options) return 1;
  options->iterations = steps;
  options->eval_count = steps / warm_up_steps;
  options->holdout_every = 0;
  nerf::Field field;
  const auto report = nerf::train(noise(), *options, {}, field);
  if (!report || report->curve.size() < 2) return 1;
  // The best of the stretches: what else ran for a moment is not the machine.
  double step_s = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < report->curve.size(); ++i) {
    const nerf::CurvePoint &from = report->curve[i - 1], &to = report->curve[i];
    if (to.step > from.step)
      step_s =
          std::min(step_s, (to.wall_s - from.wall_s) / static_cast<double>(to.step - from.step));
  }
  if (!(step_s > 0) || !std::isfinite(step_s)) return 1;
  return stage_slowness(step_s / reference_step_s);
}

}  // namespace orbitfuse::planning
