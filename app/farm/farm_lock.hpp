// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"

namespace orbitfuse::farm {

/// farm.lock: who changes the farm. A file that names host, boot and process, made by link(2),
/// which is one step on NFS as well; flock is not everywhere one between hosts. A holder that died
/// is told by its process on the same host, never by the age of a file: clocks of hosts differ. A
/// Slurm job that is started again elsewhere replaces its own earlier start, on the lost node.
class FarmLock {
 public:
  FarmLock() = default;
  FarmLock(const FarmLock&) = delete;
  FarmLock& operator=(const FarmLock&) = delete;
  ~FarmLock();
  /// Usage error naming the holder while it may be alive; on another host nobody here can know.
  Status acquire(const std::filesystem::path& out);
  /// Nobody works in the farm: no lock, or of one who died here. On another host nobody can know.
  static bool is_free(const std::filesystem::path& out);

 private:
  std::filesystem::path file_;  ///< empty: not held
};

}  // namespace orbitfuse::farm
