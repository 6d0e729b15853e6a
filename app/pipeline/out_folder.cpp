// SPDX-License-Identifier: BSD-3-Clause
#include "app/pipeline/out_folder.hpp"

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "app/pipeline/stage_record.hpp"

namespace orbitfuse::pipeline {
namespace {
namespace fs = std::filesystem;

tl::unexpected<Error> refused(const fs::path& folder, const std::error_code& error) {
  if (error == std::errc::filename_too_long)
    return fail(ErrorKind::usage, folder.string(), error.message(), "choose a shorter name");
  return fail(ErrorKind::device, folder.string(), error.message(),
              "check its permissions and free space, or choose another folder");
}

/// Permissions alone don't tell: the superuser has them all, and a disk may be full or read-only.
Status try_in(const fs::path& existing, const fs::path& folder) {
  std::string probe = existing / ".orbitfuse-XXXXXX";
  if (::mkdtemp(probe.data()) == nullptr) return refused(folder, {errno, std::generic_category()});
  ::rmdir(probe.c_str());
  return {};
}

}  // namespace

Status check_outside_stages(const fs::path& target) {
  std::error_code unreadable;  // whoever writes there says why
  // A name that is not there yet stays relative.
  fs::path part = fs::weakly_canonical(fs::absolute(target, unreadable), unreadable);
  for (; part.has_relative_path(); part = part.parent_path()) {
    if (!fs::exists(part / stage_record_file, unreadable)) continue;
    const auto record = read_stage_record(part);
    if (!record || record->stage != part.filename()) continue;  // some other program's file
    return fail(ErrorKind::usage, target.string(),
                fmt::format("inside of {}, the result of a run's stage", part.string()),
                "choose a folder outside: the next run would take what is new there for damage");
  }
  return {};
}

Status check_out_folder(const fs::path& folder) {
  ORBITFUSE_TRY(check_outside_stages(folder));
  std::error_code error;
  fs::path part = fs::absolute(folder, error);
  if (!part.has_filename()) part = part.parent_path();
  const fs::path whole = part;
  for (;; part = part.parent_path()) {
    const fs::file_status status = fs::status(part, error);
    if (fs::is_directory(status)) return try_in(part, folder);
    const bool missing = status.type() == fs::file_type::not_found;
    if (missing && !fs::is_symlink(fs::symlink_status(part, error)) && part.has_relative_path())
      continue;
    if (!missing && error) return refused(folder, error);
    const std::string what = missing ? "a broken link" : "no folder";
    return fail(ErrorKind::input, folder.string(),
                part == whole ? "is " + what : part.string() + " on its way is " + what,
                "choose another folder");
  }
}

Status check_out_file(const fs::path& file) {
  std::error_code ignored;
  if (fs::is_directory(file, ignored))
    return fail(ErrorKind::input, file.string(), "is a folder", "name a file");
  return check_out_folder(fs::absolute(file, ignored).parent_path());
}

}  // namespace orbitfuse::pipeline
