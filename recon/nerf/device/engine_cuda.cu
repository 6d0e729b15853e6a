// SPDX-License-Identifier: BSD-3-Clause
#define ORBITFUSE_ENGINE cuda
#include "recon/nerf/device/whole_engine.hpp"

namespace orbitfuse::nerf::cuda {
struct SetOne {
  float* number;
  ORBITFUSE_HOST_DEVICE void operator()(int) const { *number = 1; }
};
}  // namespace orbitfuse::nerf::cuda

namespace orbitfuse::nerf::device {
namespace {

class CudaEngine final : public cuda::WholeEngine {
 public:
  CudaEngine() {
    int count = 0;
    cuda::check(cudaGetDeviceCount(&count));
    if (count == 0) throw Refused{"no CUDA device"};
    cudaDeviceProp properties;
    cuda::check(cudaGetDeviceProperties(&properties, 0));
    name_ = properties.name;
    // Whether this build has code for it, and it has memory, shows only here.
    cuda::Buffer<float> number;
    number.zeros(1);
    cuda::launch(1, cuda::SetOne{number.data()});
    if (number.download(1).front() != 1) throw Refused{name_ + " doesn't compute"};
  }
  std::string name() const override { return name_; }

 private:
  std::string name_;
};

}  // namespace

std::unique_ptr<Engine> cuda_engine() { return std::make_unique<CudaEngine>(); }

}  // namespace orbitfuse::nerf::device

namespace orbitfuse::nerf {
bool built_with_cuda();  // compute_device.hpp, which is not C++17
bool built_with_cuda() { return true; }
}  // namespace orbitfuse::nerf
