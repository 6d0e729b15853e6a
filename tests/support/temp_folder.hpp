// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "core/system/scratch_folder.hpp"

namespace orbitfuse::test {

/// A folder of its own for each test, removed afterwards.
class TempFolder {
 public:
  const std::filesystem::path& path() const { return folder_.path(); }
  std::filesystem::path operator/(const std::string& name) const { return path() / name; }

 private:
  ScratchFolder folder_ = ScratchFolder::make().value();
};

inline void put(const std::filesystem::path& file, const std::string& bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << bytes;
}

/// A file that can be run.
inline void put_program(const std::filesystem::path& file, const std::string& script) {
  put(file, script);
  std::filesystem::permissions(file, std::filesystem::perms::owner_all);
}

inline std::string get(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace orbitfuse::test
