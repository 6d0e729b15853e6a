// SPDX-License-Identifier: BSD-3-Clause
#include "app/pipeline/result_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <cstdio>
#include <system_error>

#include "app/pipeline/stage_record.hpp"

namespace orbitfuse::pipeline {
namespace fs = std::filesystem;

namespace {

Status device_error(const fs::path& path, const std::error_code& ec) {
  if (!ec) return {};
  return fail(ErrorKind::device, path.string(), ec.message(),
              "check permissions and free space, then run again with --resume");
}

}  // namespace

Status make_folder(const fs::path& folder) {
  std::error_code ec;
  fs::create_directories(folder, ec);
  return device_error(folder, ec);
}

Status remove_tree(const fs::path& folder) {
  std::error_code ec;
  fs::remove_all(folder, ec);
  return device_error(folder, ec);
}

Status replace_folder(const fs::path& from, const fs::path& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_EXCHANGE) == 0)
    return remove_tree(from);
  // Absent, or a file system that can't exchange: in two steps, of which the first is taken back
  // where the second fails.
  fs::path old = from;
  old += ".old";
  std::error_code ec;
  const bool there = fs::exists(fs::symlink_status(to, ec));
  if (there) {
    ORBITFUSE_TRY(remove_tree(old));
    fs::rename(to, old, ec);
    ORBITFUSE_TRY(device_error(to, ec));
  }
  fs::rename(from, to, ec);
  if (ec && there) {
    std::error_code back;
    fs::rename(old, to, back);
  }
  ORBITFUSE_TRY(device_error(to, ec));
  return remove_tree(old);
}

Status check_place(const fs::path& folder) {
  std::error_code unreadable;
  if (!fs::exists(fs::symlink_status(folder, unreadable)) ||
      fs::exists(folder / stage_record_file, unreadable) ||
      (fs::is_directory(folder, unreadable) && fs::is_empty(folder, unreadable)))
    return {};
  return fail(ErrorKind::usage, folder.string(),
              fmt::format("is there already, and no run left it (no {} in it)", stage_record_file),
              "choose another --out, or move it away");
}

}  // namespace orbitfuse::pipeline
