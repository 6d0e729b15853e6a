// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/scratch_folder.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace orbitfuse {
namespace fs = std::filesystem;

Result<ScratchFolder> ScratchFolder::make(const fs::path& parent) {
  std::error_code unknown;
  const fs::path usual = fs::temp_directory_path(unknown);
  const fs::path base = !parent.empty() ? parent : unknown ? fs::path("/tmp") : usual;
  std::string pattern = (base / "orbitfuse-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) {
    return fail(ErrorKind::device, base.string(),
                std::string("no folder can be made in it: ") + std::strerror(errno),
                "check its disk and rights, or name another with TMPDIR");
  }
  return ScratchFolder(pattern);
}

ScratchFolder::ScratchFolder(ScratchFolder&& other) noexcept
    : path_(std::exchange(other.path_, {})) {}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove_all(path_, ignored);
}

}  // namespace orbitfuse
