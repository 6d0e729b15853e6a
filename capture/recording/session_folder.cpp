// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/session_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

/// Names like "new/../s" stay as they are: the kernel goes through "new" too.
fs::path without_trailing_slash(const fs::path& folder) {
  const fs::path plain = fs::absolute(folder);
  return plain.has_filename() ? plain : plain.parent_path();
}

tl::unexpected<Error> cannot_make(const fs::path& folder, const std::error_code& error) {
  switch (error.value()) {
    case ENAMETOOLONG:
      return fail(ErrorKind::usage, folder.string(), error.message(), "choose a shorter name");
    case ENOTDIR:
    case EEXIST:
      return fail(ErrorKind::input, folder.string(),
                  "a part of the path is a file or a broken link", "choose another folder");
    case ENOSPC:
    case EDQUOT:
      return fail(ErrorKind::device, folder.string(), error.message(),
                  "free disk space, or record to another disk");
    default:
      return fail(ErrorKind::device, folder.string(), error.message(),
                  "check the permissions, or choose another folder");
  }
}

std::string mebibytes(std::uint64_t bytes) {
  return fmt::format("{:.0f} MiB", static_cast<double>(bytes) / (1 << 20));
}

/// What a recording or import leaves that is killed as it begins: not even the header's line.
bool holds_only_a_begun_manifest(const fs::path& folder) {
  std::error_code error;
  for (const char* images : {"visible", "thermal"})
    if (fs::exists(folder / images, error) && !fs::is_empty(folder / images, error)) return false;
  const auto text = read_file(folder / "manifest.jsonl", 65536);
  return text && text->find('\n') == text->npos;
}

}  // namespace

bool is_being_recorded(const fs::path& folder) {
  const int fd = ::open((folder / "manifest.jsonl").c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return false;
  const bool taken = ::flock(fd, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(fd);
  return taken;
}

std::optional<std::uint64_t> free_bytes_at(const fs::path& folder) {
  std::error_code error;
  fs::path existing = without_trailing_slash(folder);
  while (!fs::exists(existing, error) && existing != existing.parent_path())
    existing = existing.parent_path();
  const auto space = fs::space(existing, error);
  if (error) return std::nullopt;
  return space.available;
}

Status check_free_space(const fs::path& folder, std::uint64_t needed_bytes, const char* remedy) {
  const std::optional<std::uint64_t> available = free_bytes_at(folder);
  if (!available || *available >= needed_bytes) return {};
  return fail(
      ErrorKind::device, folder.string(),
      fmt::format("{} free on the disk, {} needed", mebibytes(*available), mebibytes(needed_bytes)),
      remedy);
}

bool holds_session(const fs::path& folder) {
  std::error_code error;
  return fs::exists(folder / "manifest.jsonl", error);
}

Status check_is_new(const fs::path& folder) {
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  if (status.type() == fs::file_type::not_found) return {};
  if (error) return cannot_make(folder, error);
  const char* remedy = "choose another folder";
  if (!fs::is_directory(status))
    return fail(ErrorKind::input, folder.string(), "is not a folder", remedy);
  const bool empty = fs::is_empty(folder, error);
  if (error) return cannot_make(folder, error);
  if (empty) return {};
  if (holds_only_a_begun_manifest(folder))
    return fail(ErrorKind::input, folder.string(),
                "holds a manifest without one whole line, and no frames: of a recording or import "
                "that was killed as it began",
                "delete its manifest.jsonl if none begins there now, or choose another folder");
  return fail(ErrorKind::input, folder.string(),
              holds_session(folder) ? "holds a session already" : "is not an empty folder", remedy);
}

Status MadeFolders::make(const fs::path& folder) {
  std::vector<fs::path> missing;
  std::error_code error;
  for (fs::path p = without_trailing_slash(folder); p != p.parent_path(); p = p.parent_path()) {
    const fs::file_status status = fs::status(p, error);
    if (status.type() == fs::file_type::not_found) {
      missing.push_back(p);
      continue;
    }
    if (error) return cannot_make(folder, error);
    if (!fs::is_directory(status))
      return cannot_make(folder, std::make_error_code(std::errc::not_a_directory));
    break;
  }
  for (auto p = missing.rbegin(); p != missing.rend(); ++p) {
    const bool made = fs::create_directory(*p, error);
    if (error) return cannot_make(folder, error);
    if (made) made_.push_back(*p);
  }
  return {};
}

MadeFolders::~MadeFolders() {
  std::error_code ignored;
  for (auto p = made_.rbegin(); p != made_.rend(); ++p) fs::remove(*p, ignored);
}

}  // namespace orbitfuse
