// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>

namespace orbitfuse {

/// A fresh folder that goes away with the test.
struct TempFolder {
  TempFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "orbitfuse-XXXXXX").string();
    path = mkdtemp(name.data());
  }
  ~TempFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;

  std::filesystem::path path;
};

}  // namespace orbitfuse
