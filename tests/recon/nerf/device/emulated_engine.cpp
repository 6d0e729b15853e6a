// SPDX-License-Identifier: BSD-3-Clause
// The devices' source as the processor runs it, thread after thread.
#define ORBITFUSE_ENGINE emulated
#include "recon/nerf/device/whole_engine.hpp"
#include "tests/recon/nerf/device/machines.hpp"

namespace orbitfuse::nerf {
namespace {

class EmulatedEngine final : public emulated::WholeEngine {
 public:
  std::string name() const override { return "emulated"; }
};

}  // namespace

std::unique_ptr<device::Engine> test::emulated_engine() {
  return std::make_unique<EmulatedEngine>();
}

}  // namespace orbitfuse::nerf
