// SPDX-License-Identifier: BSD-3-Clause
// In place of engine_cuda.cu.
#include "recon/nerf/compute_device.hpp"
#include "recon/nerf/device/engine.hpp"

namespace orbitfuse::nerf {

bool built_with_cuda() { return false; }

namespace device {

std::unique_ptr<Engine> cuda_engine() {
  throw Refused{"this build computes on the processor only (configure with -DORBITFUSE_CUDA=ON)"};
}

}  // namespace device
}  // namespace orbitfuse::nerf
