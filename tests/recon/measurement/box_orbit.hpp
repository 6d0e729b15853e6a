// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <memory>

#include "recon/measurement/measure.hpp"
#include "recon/measurement/thermal_scene.hpp"
#include "tests/support/box_scene.hpp"
#include "tests/support/orbit_fixture.hpp"

// A ray-cast box that two loops of thermal cameras go round: every temperature is known exactly.
namespace orbitfuse::measurement::testing_box {

inline constexpr double end_k = 300, side_k = 309, rib_k = 311.4, top_k = 303;

inline cv::Mat kelvin_of(const SceneRender& seen) {
  cv::Mat kelvin;
  seen.brightness.convertTo(kelvin, CV_32F, 20, 290);
  return kelvin;
}

inline FieldRenderer box_field() {
  return
      [](const Camera& camera, const Rigid3d& pose, const Progress& progress) -> Result<FieldView> {
        ORBITFUSE_TRY(progress.check("box"));
        const SceneRender seen = testing_orbit::box_view(camera, pose, true);
        FieldView view{kelvin_of(seen), seen.depth};
        view.temperature_k.setTo(std::nanf(""), view.depth != view.depth);
        return view;
      };
}

inline SceneParts box_parts(double radius = 2) {
  SceneParts parts;
  parts.field = box_field();
  for (PosedView& view : testing_orbit::two_loops(radius)) {
    view.camera = view.camera.scaled_to(320, 240);
    parts.orbit.push_back(view);
    parts.frames.push_back({std::move(view), {}, {}});
  }
  parts.read_frame = [](const ThermalFrame& frame) -> Result<cv::Mat> {
    return kelvin_of(testing_orbit::box_view(frame.view.camera, frame.view.cam_from_world, true));
  };
  parts.identity = "box";
  return parts;
}

inline ThermalScene box_orbit(SceneParts parts = box_parts(), MeasurementOptions options = {}) {
  auto scene = ThermalScene::make(std::move(parts), options);
  EXPECT_TRUE(scene) << scene.error().message();
  return *std::move(scene);
}

inline Request spot_at(const Eigen::Vector3d& point) {
  Request request;
  request.places = {point};
  return request;
}

inline Answer ask(const ThermalScene& scene, const Request& request) {
  auto answer = measure(scene, request, {});
  EXPECT_TRUE(answer) << answer.error().message();
  return answer ? *std::move(answer) : Answer{};
}

}  // namespace orbitfuse::measurement::testing_box
