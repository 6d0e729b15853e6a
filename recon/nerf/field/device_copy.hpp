// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <mutex>

namespace orbitfuse::nerf {

namespace device {
class Tracer;
}

/// A field in a device's memory, made when it is first rendered there. It belongs to one field: a
/// copy of that has none.
class DeviceCopy {
 public:
  DeviceCopy() = default;
  DeviceCopy(const DeviceCopy&) {}
  DeviceCopy(DeviceCopy&& other) noexcept : tracer_(std::move(other.tracer_)) {}
  DeviceCopy& operator=(const DeviceCopy& other) {
    if (this != &other) forget();
    return *this;
  }
  DeviceCopy& operator=(DeviceCopy&& other) noexcept {
    tracer_ = std::move(other.tracer_);
    return *this;
  }

  /// The field has changed.
  void forget() { tracer_.reset(); }
  /// act(tracer), one caller at a time; make() gives it where there is none.
  template <class Make, class Act>
  void with(const Make& make, const Act& act) {
    const std::lock_guard lock(mutex_);
    if (!tracer_) tracer_ = make();
    try {
      act(*tracer_);
    } catch (...) {
      tracer_.reset();  // what it could not do, it may have left half done
      throw;
    }
  }

 private:
  std::mutex mutex_;
  std::shared_ptr<device::Tracer> tracer_;  ///< shared: its type is not known here
};

}  // namespace orbitfuse::nerf
