// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/folder_change_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <cstring>

namespace orbitfuse {

FolderChangeLock::~FolderChangeLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

Status FolderChangeLock::acquire(const std::filesystem::path& folder) {
  assert(descriptor_ < 0 && "a lock is taken once");
  const std::filesystem::path named = folder.empty() ? "." : folder;
  descriptor_ = open(named.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  int locked = -1;
  while (descriptor_ >= 0 && (locked = flock(descriptor_, LOCK_EX)) != 0 && errno == EINTR) {
  }
  if (locked == 0) return {};
  if (descriptor_ >= 0)
    return fail(ErrorKind::device, named.string(),
                std::string("cannot be locked: ") + std::strerror(errno),
                "copy it to a disk that knows locks (some network disks don't)");
  return fail(ErrorKind::device, named.string(), std::strerror(errno),
              "give a folder that can be written to");
}

}  // namespace orbitfuse
