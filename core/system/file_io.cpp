// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/file_io.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <atomic>
#include <cerrno>
#include <cstring>

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  /// Network file systems report a full disk only here.
  bool close() {
    const int fd = fd_;
    fd_ = -1;
    return ::close(fd) == 0;
  }

 private:
  int fd_;
};

tl::unexpected<Error> write_failure(const fs::path& path, int error) {
  std::error_code ignored;
  const auto space = fs::space(path.parent_path(), ignored);
  const std::string free =
      ignored ? "" : fmt::format(" ({:.1f} MiB free)", static_cast<double>(space.available) / 1048576.0);
  const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
  return fail(ErrorKind::device, path.string(),
              std::string("cannot write: ") + std::strerror(error) + free,
              full ? "free disk space or choose another folder" : "check the folder and its permissions");
}

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

}  // namespace

Result<std::string> read_file(const fs::path& path) {
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) {
    return fail(ErrorKind::input, path.string(), std::strerror(errno), "check the path");
  }
  struct stat info {};
  if (::fstat(file.get(), &info) != 0 || S_ISDIR(info.st_mode)) {
    return fail(ErrorKind::input, path.string(), "not a file", "check the path");
  }
  std::string bytes(static_cast<std::size_t>(std::max<off_t>(0, info.st_size)), '\0');
  std::size_t have = 0;
  // The size is a hint: pipes and /proc report 0, and a file may grow while it is read.
  for (;;) {
    if (have == bytes.size()) bytes.resize(bytes.size() + 65536);
    const ssize_t n = ::read(file.get(), bytes.data() + have, bytes.size() - have);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return fail(ErrorKind::input, path.string(), std::strerror(errno), "check the disk");
    if (n == 0) break;
    have += static_cast<std::size_t>(n);
  }
  bytes.resize(have);
  return bytes;
}

Status sync_folder(const fs::path& folder) {
  Descriptor fd(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  // Some file systems refuse fsync on folders with EINVAL; there is nothing to add to that.
  if (fd.get() < 0 || (::fsync(fd.get()) != 0 && errno != EINVAL)) {
    return fail(ErrorKind::device, folder.string(), std::strerror(errno), "check the disk");
  }
  return {};
}

Status write_file_atomic(const fs::path& path, std::string_view bytes) {
  static std::atomic<unsigned> serial{0};
  std::error_code error;
  const fs::path folder = path.parent_path();
  if (!folder.empty()) fs::create_directories(folder, error);
  if (error) return write_failure(path, error.value());

  const fs::path temporary =
      path.string() + fmt::format(".{}-{}.tmp", ::getpid(), serial.fetch_add(1));
  Descriptor fd(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (fd.get() < 0) return write_failure(path, errno);
  if (!write_all(fd.get(), bytes) || ::fsync(fd.get()) != 0 || !fd.close() ||
      ::rename(temporary.c_str(), path.c_str()) != 0) {
    const int cause = errno;
    ::unlink(temporary.c_str());
    return write_failure(path, cause);
  }
  return sync_folder(folder);
}

std::string content_hash(std::string_view bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

Result<std::string> file_hash(const fs::path& path) {
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(path));
  return content_hash(bytes);
}

}  // namespace orbitfuse
