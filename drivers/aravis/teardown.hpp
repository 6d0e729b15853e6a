// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace orbitfuse::aravis {

/// Destroys connections, each on a thread of its own: that blocks for seconds while a camera does
/// not answer. Its last register writes stop whatever the camera streams, so a camera is opened
/// again only when its old connection is gone; not every camera refuses the writes of somebody who
/// is no longer in control.
class Teardowns {
 public:
  /// Of this process: a connection outlives the source that made it.
  static Teardowns& all();

  void begin(const std::string& address, std::shared_ptr<void> connection);
  /// True once no connection to the address (empty: to any) is being destroyed.
  bool wait(const std::string& address, std::chrono::milliseconds timeout);

 private:
  std::size_t count(const std::string& address) const;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, std::size_t> going_;  ///< by address
};

}  // namespace orbitfuse::aravis
