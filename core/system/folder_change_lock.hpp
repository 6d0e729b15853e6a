// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/result.hpp"

namespace orbitfuse {

/// Held while a file of a folder is read, changed and written again; another thread or process that
/// wants the same waits. It is the folder's own, so that nothing is left behind, and the kernel
/// releases it when the process dies.
class FolderChangeLock {
 public:
  FolderChangeLock() = default;
  FolderChangeLock(const FolderChangeLock&) = delete;
  FolderChangeLock& operator=(const FolderChangeLock&) = delete;
  ~FolderChangeLock();
  /// Device error: no such folder, or it can't be locked. "" is the working folder.
  Status acquire(const std::filesystem::path& folder);

 private:
  int descriptor_ = -1;
};

}  // namespace orbitfuse
