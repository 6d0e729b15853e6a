// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/result.hpp"

namespace orbitfuse {

/// A new folder that only its owner may enter; removed with all in it when the object ends.
class ScratchFolder {
 public:
  /// In `parent`; empty: where the system keeps temporary files (TMPDIR). Device error naming it.
  static Result<ScratchFolder> make(const std::filesystem::path& parent = {});
  ~ScratchFolder();
  ScratchFolder(ScratchFolder&& other) noexcept;
  ScratchFolder& operator=(ScratchFolder&&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  explicit ScratchFolder(std::filesystem::path path) : path_(std::move(path)) {}

  std::filesystem::path path_;
};

}  // namespace orbitfuse
