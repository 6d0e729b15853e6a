// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "recon/nerf/device/on_device.hpp"

// What computes fields: instruction sets and devices. The emulated device runs the devices' source
// on the processor, so that every line of it is tested where there is no GPU.
namespace orbitfuse::nerf::test {

/// The devices' source run by the processor in single file: slow.
std::unique_ptr<device::Engine> emulated_engine();

/// Null: it isn't here.
inline std::unique_ptr<device::Engine> engine_named(const std::string& name) {
  try {
    return name == "cuda" ? device::cuda_engine() : emulated_engine();
  } catch (const device::Refused&) {
    return nullptr;
  }
}

/// Of "avx2", ... "amx", "emulated" or "cuda"; none: not on this machine.
inline std::optional<Kernels> kernels_named(const std::string& machine) {
  for (const Isa isa : {Isa::avx2, Isa::avx512, Isa::avx512bf16, Isa::amx})
    if (machine == name(isa))
      return isa <= best_isa() ? std::optional<Kernels>(kernels_for(isa)) : std::nullopt;
  const auto engine = engine_named(machine);
  return engine ? std::optional<Kernels>(engine->kernels()) : std::nullopt;
}

/// The engine computes while this lives.
class InUse {
 public:
  explicit InUse(std::unique_ptr<device::Engine> engine) { device::use(std::move(engine)); }
  ~InUse() { device::use(nullptr); }
  InUse(const InUse&) = delete;
  InUse& operator=(const InUse&) = delete;
};

}  // namespace orbitfuse::nerf::test
