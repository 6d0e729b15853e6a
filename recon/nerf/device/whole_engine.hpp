// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/as_kernels.hpp"
#include "recon/nerf/device/tracing.hpp"
#include "recon/nerf/device/training_steps.hpp"

namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

/// All of an engine but its name.
class WholeEngine : public device::Engine {
 public:
  std::unique_ptr<device::Steps> steps(const device::FieldNumbers& field,
                                       const std::vector<device::Photo>& photos,
                                       const PixelTilesView& tiles) override {
    return std::make_unique<TrainingSteps>(field, photos, tiles);
  }
  std::unique_ptr<device::Tracer> tracer(const device::FieldNumbers& field) override {
    return std::make_unique<FieldTracer>(field);
  }
  Kernels kernels() const override { return as_kernels(); }
  void time_kernels() override { launch_times().wanted = true; }
  std::vector<device::KernelTime> kernel_times() const override { return launch_times().all(); }
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
