// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>

#include "recon/nerf/nerf.hpp"

namespace orbitfuse::nerf::test {

/// A ball of radius 0.4 * `scale` with a smooth pattern before a plain background, seen by `views`
/// cameras on a ring of radius `scale`. Thermal: 290 K background, the ball 295 to 305 K.
Dataset toy_scene(Modality modality, int views, double scale = 1, int pixels = 32);

/// Exact depth of the ball; the background has none.
std::vector<DepthMap> toy_depth(const Dataset& data, double scale = 1.0);

/// A run short enough for a test.
TrainOptions toy_options(Modality modality, int iterations);

/// Asks a run to stop once it tells of so many steps.
struct StopAt {
  std::atomic<bool> stop = false;
  Progress progress;
  explicit StopAt(double steps) {
    progress.cancel = &stop;
    progress.report = [this, steps](const ProgressEvent& event) { stop = event.done >= steps; };
  }
};

}  // namespace orbitfuse::nerf::test
