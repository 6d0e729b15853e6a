// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/file.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>

// In one source of a test program: stands in for libc's flock, so that a disk without locks can be
// had.
namespace orbitfuse::test {

inline int refused_lock_error = 0;  ///< 0: the kernel answers

/// While it lives, no lock is given.
struct NoLocks {
  explicit NoLocks(int error = ENOLCK) { refused_lock_error = error; }
  ~NoLocks() { refused_lock_error = 0; }
};

}  // namespace orbitfuse::test

extern "C" inline __attribute__((used)) int flock(int fd, int operation) {
  if (orbitfuse::test::refused_lock_error == 0)
    return static_cast<int>(::syscall(SYS_flock, fd, operation));
  errno = orbitfuse::test::refused_lock_error;
  return -1;
}
