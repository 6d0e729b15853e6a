// SPDX-License-Identifier: BSD-3-Clause
// The devices' source as the processor runs it, thread after thread.
#define ORBITFUSE_ENGINE emulated
#include "recon/nerf/device/as_kernels.hpp"
#include "recon/nerf/device/tracing.hpp"
#include "recon/nerf/device/training_steps.hpp"
#include "tests/recon/nerf/device/machines.hpp"

namespace orbitfuse::nerf {
namespace {

using namespace device;

class EmulatedEngine final : public Engine {
 public:
  std::string name() const override { return "emulated"; }
  std::unique_ptr<Steps> steps(const FieldNumbers& field,
                               const std::vector<Photo>& photos) override {
    return std::make_unique<emulated::TrainingSteps>(field, photos);
  }
  std::unique_ptr<Tracer> tracer(const FieldNumbers& field) override {
    return std::make_unique<emulated::FieldTracer>(field);
  }
  Kernels kernels() const override { return emulated::as_kernels(); }
  void time_kernels() override { emulated::launch_times().wanted = true; }
  std::vector<KernelTime> kernel_times() const override { return emulated::launch_times().all(); }
};

}  // namespace

std::unique_ptr<Engine> test::emulated_engine() { return std::make_unique<EmulatedEngine>(); }

}  // namespace orbitfuse::nerf
