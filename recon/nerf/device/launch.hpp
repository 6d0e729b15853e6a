// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One source for two machines. nvcc makes a kernel of each functor; g++ makes a loop of it, by
// which tests see every line of what a device runs without having one. Part of an engine: included
// by engine_cuda.cu, the tests' emulated_engine.cpp and march_pieces_test.cpp alone, each with its
// own ORBITFUSE_ENGINE, so that the linker doesn't take one's for the other's. C++17: nvcc of
// Debian 12 knows no more.
#include <cxxabi.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <typeinfo>
#include <utility>
#include <vector>

#include "core/host_device.hpp"
#include "recon/nerf/device/engine.hpp"

#ifdef __CUDACC__
#include <cuda_fp16.h>
#include <cuda_runtime.h>

#include <cub/device/device_scan.cuh>
#else
#include <immintrin.h>

#include <cmath>
#include <numeric>
#endif

namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

/// Where the time goes, if somebody asks: by the functors' names.
struct LaunchTimes {
  bool wanted = false;
  std::map<std::string, device::KernelTime> by_type;

  void add(const char* type, double seconds) {
    device::KernelTime& time = by_type[type];
    ++time.launches;
    time.seconds += seconds;
  }
  std::vector<device::KernelTime> all() const {
    std::vector<device::KernelTime> out;
    for (const auto& [type, time] : by_type) {
      out.push_back(time);
      int failed = 0;
      char* words = abi::__cxa_demangle(type.c_str(), nullptr, nullptr, &failed);
      const std::string name = failed == 0 ? words : type;
      std::free(words);
      out.back().name = name.substr(name.rfind(':') + 1);
    }
    return out;
  }
};
inline LaunchTimes& launch_times() {
  static LaunchTimes times;
  return times;
}

#ifdef __CUDACC__

inline void check(cudaError_t status) {
  if (status == cudaSuccess) return;
  cudaGetLastError();  // or the next launch would be taken for failed, too
  throw device::Refused{cudaGetErrorString(status)};
}
inline void* allocate(std::size_t bytes) {
  void* memory = nullptr;
  check(cudaMalloc(&memory, bytes));
  return memory;
}
inline void release(void* memory) { cudaFree(memory); }
inline void copy_to(void* device, const void* host, std::size_t bytes) {
  check(cudaMemcpy(device, host, bytes, cudaMemcpyHostToDevice));
}
inline void copy_from(void* host, const void* device, std::size_t bytes) {
  check(cudaMemcpy(host, device, bytes, cudaMemcpyDeviceToHost));
}
inline void fill_bytes(void* device, int byte, std::size_t bytes) {
  check(cudaMemsetAsync(device, byte, bytes));
}

template <class Work>
__global__ void run_all(int count, Work work) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < count) work(i);
}

/// work(i) for i in [0, count), in any order.
template <class Work>
void launch(int count, const Work& work) {
  if (count <= 0) return;
  constexpr int threads = 128;
  const int blocks = (count + threads - 1) / threads;
  if (!launch_times().wanted) {
    run_all<<<blocks, threads>>>(count, work);
    check(cudaGetLastError());
    return;
  }
  static const auto events = [] {
    std::pair<cudaEvent_t, cudaEvent_t> out;
    check(cudaEventCreate(&out.first));
    check(cudaEventCreate(&out.second));
    return out;
  }();
  check(cudaEventRecord(events.first));
  run_all<<<blocks, threads>>>(count, work);
  check(cudaEventRecord(events.second));
  check(cudaEventSynchronize(events.second));
  float milliseconds = 0;
  check(cudaEventElapsedTime(&milliseconds, events.first, events.second));
  launch_times().add(typeid(Work).name(), 1e-3 * static_cast<double>(milliseconds));
}

#else

inline void* allocate(std::size_t bytes) { return ::operator new (bytes, std::align_val_t{64}); }
inline void release(void* memory) { ::operator delete (memory, std::align_val_t{64}); }
inline void copy_to(void* device, const void* host, std::size_t bytes) {
  if (bytes > 0) std::memcpy(device, host, bytes);
}
inline void copy_from(void* host, const void* device, std::size_t bytes) {
  if (bytes > 0) std::memcpy(host, device, bytes);
}
inline void fill_bytes(void* device, int byte, std::size_t bytes) {
  if (bytes > 0) std::memset(device, byte, bytes);
}

/// work(i) for i in [0, count), from the last to the first: no thread may count on another's having
/// been before it.
template <class Work>
void launch(int count, const Work& work) {
  for (int i = count - 1; i >= 0; --i) work(i);
}

#endif

/// Memory of the device. Contents are lost when it grows.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  explicit Buffer(const std::vector<T>& from) { upload(from); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  Buffer(Buffer&& other) noexcept { *this = std::move(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~Buffer() {
    if (data_ != nullptr) release(data_);
  }

  T* data() const { return data_; }
  std::size_t size() const { return size_; }
  /// What grows again gets a quarter more than it asks for.
  void need(std::size_t count) {
    if (count <= size_) return;
    const std::size_t roomy = size_ > 0 ? count + count / 4 : count;
    if (data_ != nullptr) release(data_);
    data_ = nullptr;
    size_ = 0;
    data_ = static_cast<T*>(allocate(roomy * sizeof(T)));
    size_ = roomy;
  }
  void zeros(std::size_t count) {
    need(count);
    fill_bytes(data_, 0, count * sizeof(T));
  }
  void upload(const T* from, std::size_t count) {
    need(count > 0 ? count : 1);
    copy_to(data_, from, count * sizeof(T));
  }
  void upload(const std::vector<T>& from) { upload(from.data(), from.size()); }
  std::vector<T> download(std::size_t count) const {
    std::vector<T> out(count);
    copy_from(out.data(), data_, count * sizeof(T));
    return out;
  }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// first[i] = sum of counts before i, for i in [0, count]; counts[count] is set to 0.
class Scan {
 public:
  void run(int* counts, int count, int* first) {
    fill_bytes(counts + count, 0, sizeof(int));
#ifdef __CUDACC__
    std::size_t bytes = 0;
    check(cub::DeviceScan::ExclusiveSum(nullptr, bytes, counts, first, count + 1));
    scratch_.need(bytes);
    check(cub::DeviceScan::ExclusiveSum(scratch_.data(), bytes, counts, first, count + 1));
#else
    std::exclusive_scan(counts, counts + count + 1, first, 0);
#endif
  }

 private:
  Buffer<unsigned char> scratch_;
};

// ---- sums that don't depend on the order in which threads add --------------------------------

/// Parts of 2^-44: gradients of a mean over rays are far below 1, and Adam makes steps of the
/// smallest. A part beyond 8 counts as 8; 65,535 of these fit, more than a step's samples that meet
/// one entry.
constexpr double fixed_unit = 1.0 / (1ull << 44);
constexpr float largest_part = 8.0f;

ORBITFUSE_HOST_DEVICE inline void add_to(long long* sum, long long part) {
#ifdef __CUDA_ARCH__
  atomicAdd(reinterpret_cast<unsigned long long*>(sum), static_cast<unsigned long long>(part));
#else
  *sum += part;
#endif
}
ORBITFUSE_HOST_DEVICE inline long long fixed_of(float value) {
  const float upper = value < largest_part ? value : largest_part;
  const float bounded = upper > -largest_part ? upper : -largest_part;
  return static_cast<long long>(bounded * static_cast<float>(1ull << 44));
}
ORBITFUSE_HOST_DEVICE inline float value_of(long long fixed) {
  return static_cast<float>(static_cast<double>(fixed) * fixed_unit);
}
/// *largest = max(*largest, value) of values >= 0, or -1: their bits are in the order of the
/// values.
ORBITFUSE_HOST_DEVICE inline void raise_to(float* largest, float value) {
#ifdef __CUDA_ARCH__
  atomicMax(reinterpret_cast<int*>(largest), __float_as_int(value));
#else
  if (value > *largest) *largest = value;
#endif
}
ORBITFUSE_HOST_DEVICE inline void put_bit(std::uint64_t* bits, long long at, bool value) {
  const std::uint64_t bit = std::uint64_t{1} << (at & 63);
#ifdef __CUDA_ARCH__
  auto* word = reinterpret_cast<unsigned long long*>(bits + (at >> 6));
  if (value)
    atomicOr(word, bit);
  else
    atomicAnd(word, ~bit);
#else
  bits[at >> 6] = value ? bits[at >> 6] | bit : bits[at >> 6] & ~bit;
#endif
}

ORBITFUSE_HOST_DEVICE inline float float_of_half(std::uint16_t bits) {
#ifdef __CUDACC__
  __half_raw raw;
  raw.x = bits;
  return __half2float(__half(raw));
#else
  return _cvtsh_ss(bits);
#endif
}
ORBITFUSE_HOST_DEVICE inline std::uint16_t half_of(float value) {
#ifdef __CUDACC__
  return static_cast<__half_raw>(__float2half_rn(value)).x;
#else
  return static_cast<std::uint16_t>(_cvtss_sh(value, 0));
#endif
}
ORBITFUSE_HOST_DEVICE inline bool is_finite(float value) { return value - value == 0.0f; }

/// Loaded at once.
struct alignas(16) Four {
  float v[4];
};
ORBITFUSE_HOST_DEVICE inline Four load_four(const float* from) {
  return *reinterpret_cast<const Four*>(from);
}

/// Numbers of samples, one row a feature: sample s of row k is at[k * stride + s]. Threads that
/// stand side by side read side by side.
struct Rows {
  float* at;
  long stride;
  ORBITFUSE_HOST_DEVICE float& operator()(int row, int sample) const {
    return at[row * stride + sample];
  }
  ORBITFUSE_HOST_DEVICE float* row(int index) const { return at + index * stride; }
};

/// How many samples there are, which only the device knows, and the most there can be.
struct SampleCount {
  const int* counted;
  int bound;
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
