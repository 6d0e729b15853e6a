// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/result.hpp"

namespace orbitfuse::pipeline {

/// Held while a run writes its folder; two runs in one folder would mix their results. The kernel
/// releases it when the process dies, however it dies.
class FolderLock {
 public:
  FolderLock() = default;
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  ~FolderLock();
  Status acquire(const std::filesystem::path& file);

 private:
  int descriptor_ = -1;
};

}  // namespace orbitfuse::pipeline
