// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/file_io.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
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
      ignored ? ""
              : fmt::format(" ({:.1f} MiB free)", static_cast<double>(space.available) / 1048576.0);
  const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
  return fail(
      ErrorKind::device, path.string(), std::string("cannot write: ") + std::strerror(error) + free,
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

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder, not a file";
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device, not a file";
  if (S_ISFIFO(mode)) return "a pipe, not a file";
  return "not a file";
}

/// Opened for reading, and what the system says of it. Without O_NONBLOCK a pipe would be waited
/// for.
Result<Descriptor> open_regular(const fs::path& path, struct stat& info) {
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) {
    return fail(ErrorKind::input, path.string(), std::strerror(errno),
                errno == EACCES ? "check its permissions" : "check the path");
  }
  if (::fstat(file.get(), &info) != 0 || !S_ISREG(info.st_mode)) {
    return fail(ErrorKind::input, path.string(), kind_of(info.st_mode), "check the path");
  }
  return file;
}

tl::unexpected<Error> too_large(const fs::path& path, std::uint64_t size, std::uint64_t at_most) {
  constexpr double mebibyte = 1 << 20;
  return fail(
      ErrorKind::input, path.string(),
      fmt::format("{:.0f} MiB, at most {:.0f} MiB are read", static_cast<double>(size) / mebibyte,
                  static_cast<double>(at_most) / mebibyte),
      "is it the file you mean?");
}

std::string hex(XXH128_hash_t hash) {
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

/// Bytes read, 0 at the end, -1 on an error.
ssize_t read_some(int fd, char* to, std::size_t count) {
  for (;;) {
    const ssize_t n = ::read(fd, to, count);
    if (n >= 0 || errno != EINTR) return n;
  }
}

}  // namespace

Result<std::string> read_file(const fs::path& path, std::uint64_t at_most) {
  struct stat info {};
  ORBITFUSE_ASSIGN(const Descriptor file, open_regular(path, info));
  const auto size = static_cast<std::uint64_t>(std::max<off_t>(0, info.st_size));
  if (size > at_most) return too_large(path, size, at_most);
  std::string bytes(size + 1, '\0');  // one more: the end is seen without growing
  std::size_t have = 0;
  // The size is a hint: files of /proc report 0, and a file may grow while it is read.
  for (;;) {
    if (have == bytes.size()) bytes.resize(bytes.size() + 65536);
    const ssize_t n = read_some(file.get(), bytes.data() + have, bytes.size() - have);
    if (n < 0) return fail(ErrorKind::input, path.string(), std::strerror(errno), "check the disk");
    if (n == 0) break;
    have += static_cast<std::size_t>(n);
    if (have > at_most) return too_large(path, have, at_most);
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
  return hex(XXH3_128bits(bytes.data(), bytes.size()));
}

Result<std::string> file_hash(const fs::path& path) {
  struct stat info {};
  ORBITFUSE_ASSIGN(const Descriptor file, open_regular(path, info));
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(),
                                                                       &XXH3_freeState);
  XXH3_128bits_reset(state.get());
  std::string piece(1 << 20, '\0');
  for (;;) {
    const ssize_t n = read_some(file.get(), piece.data(), piece.size());
    if (n < 0) return fail(ErrorKind::input, path.string(), std::strerror(errno), "check the disk");
    if (n == 0) break;
    XXH3_128bits_update(state.get(), piece.data(), static_cast<std::size_t>(n));
  }
  return hex(XXH3_128bits_digest(state.get()));
}

}  // namespace orbitfuse
