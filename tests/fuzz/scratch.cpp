// SPDX-License-Identifier: BSD-3-Clause
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include "core/system/scratch_folder.hpp"
#include "tests/fuzz/targets.hpp"

namespace orbitfuse::fuzz {

ScratchFile::ScratchFile() : fd_(::memfd_create("fuzz", 0)) {
  if (fd_ < 0) std::abort();
}
ScratchFile::~ScratchFile() { ::close(fd_); }

std::string ScratchFile::with(std::string_view bytes) const {
  if (::ftruncate(fd_, 0) != 0 ||
      ::pwrite(fd_, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    std::abort();
  return "/proc/self/fd/" + std::to_string(fd_);
}

const std::string& scratch_folder() {
  static const ScratchFolder folder = ScratchFolder::make("/dev/shm").value();
  return folder.path().native();
}

const Target* find(const std::vector<Target>& targets, std::string_view name) {
  for (const Target& target : targets) {
    if (name == target.name) return &target;
  }
  return nullptr;
}

}  // namespace orbitfuse::fuzz
