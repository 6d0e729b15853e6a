// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <stdexcept>

#include "app/view/finished_run.hpp"
#include "tests/support/toy_scene.hpp"

namespace orbitfuse::view::test {

/// A run of both modalities on the ball of nerf::test::toy_scene: 290 K background, the ball 295 to
/// 305 K; coarsely trained.
inline FinishedRun toy_run(const std::filesystem::path& out) {
  FinishedRun run;
  run.out = out;
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const nerf::Dataset data = nerf::test::toy_scene(modality, 6);
    nerf::Field& field = modality == Modality::visible ? run.visible : run.thermal;
    const auto trained = nerf::train(data, nerf::test::toy_options(modality, 60), {}, field);
    if (!trained) throw std::runtime_error(trained.error().message());
    for (std::size_t i = 0; i < data.views.size(); ++i)
      run.views.push_back({modality,
                           {data.views[i].name, data.views[i].camera, data.views[i].cam_from_world},
                           i == 1 ? std::optional<std::string>("a doubt") : std::nullopt});
  }
  for (int i = 0; i < 1000; ++i) {
    const double z = 1 - (2 * i + 1) / 1000.0, r = std::sqrt(1 - z * z), a = 2.4 * i;
    run.surface.positions.push_back(0.4 * Eigen::Vector3d(r * std::cos(a), r * std::sin(a), z));
    run.surface.colors.push_back({200, 60, 40});
    run.surface.temperatures_k.push_back(static_cast<float>(300 + 5 * z));
  }
  run.span = {290, 305};
  run.heat = {290, 1, 305};
  return run;
}

}  // namespace orbitfuse::view::test
