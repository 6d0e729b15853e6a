// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/teardown.hpp"

#include <thread>
#include <utility>

namespace orbitfuse::aravis {

Teardowns& Teardowns::all() {
  // Never destroyed: a thread may still be at it when the program ends.
  static Teardowns* const one = new Teardowns;
  return *one;
}

void Teardowns::begin(const std::string& address, std::shared_ptr<void> connection) {
  {
    const std::lock_guard lock(mutex_);
    ++going_[address];
  }
  // Detached: the program's end must not wait for a camera that is gone.
  std::thread([this, address, connection = std::move(connection)]() mutable {
    connection.reset();
    const std::lock_guard lock(mutex_);
    if (--going_[address] == 0) going_.erase(address);
    changed_.notify_all();
  }).detach();
}

std::size_t Teardowns::count(const std::string& address) const {
  return address.empty() ? going_.size() : going_.count(address);
}

bool Teardowns::wait(const std::string& address, std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, timeout, [&] { return count(address) == 0; });
}

}  // namespace orbitfuse::aravis
