// SPDX-License-Identifier: BSD-3-Clause
#include "app/pipeline/folder_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace orbitfuse::pipeline {

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

Status FolderLock::acquire(const std::filesystem::path& file) {
  descriptor_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor_ < 0)
    return fail(ErrorKind::device, file.parent_path().string(), std::strerror(errno),
                "choose a folder you can write to with --out");
  if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return {};
  if (errno == EWOULDBLOCK)
    return fail(ErrorKind::usage, file.parent_path().string(),
                "another orbitfuse is writing to this folder",
                "wait for it or choose another folder with --out");
  return fail(ErrorKind::device, file.string(),
              std::string("cannot be locked: ") + std::strerror(errno),
              "choose a folder on a disk that knows locks with --out (some network disks don't)");
}

}  // namespace orbitfuse::pipeline
