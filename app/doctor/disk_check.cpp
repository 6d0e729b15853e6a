// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>

#include "app/doctor/checks.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::doctor {

/// A run writes many small files and fsyncs each; a slow disk shows here first.
Finding check_disk(const std::filesystem::path& folder, bool dry_run) {
  namespace fs = std::filesystem;
  std::error_code ec;
  const auto space = fs::space(folder, ec);
  if (ec)
    return {"disk", folder.string() + ": " + ec.message(),
            "choose a folder that exists with --folder", true, ErrorKind::input};
  if (!fs::is_directory(folder, ec))
    return {"disk", folder.string() + ": is not a folder", "choose a folder with --folder", true,
            ErrorKind::input};
  const double free_gib = static_cast<double>(space.available) / (1 << 30);
  const std::string more_space = free_gib < 2 ? "free some space: a run needs about 2 GiB" : "";
  const char* other_folder = "choose a folder you can write to";
  if (dry_run) {
    if (::access(folder.c_str(), W_OK) != 0)
      return {"disk", folder.string() + ": " + std::strerror(errno), other_folder, true,
              ErrorKind::device};
    return {
        "disk",
        fmt::format("{:.1f} GiB free, its speed not measured: --dry-run writes nothing", free_gib),
        more_space, true, ErrorKind::device};
  }
  constexpr int writes = 20;
  const std::string block(1 << 20, 'x');
  const fs::path probe = folder / ".orbitfuse-doctor";
  const auto start = std::chrono::steady_clock::now();
  Status status;
  for (int i = 0; i < writes && status; ++i) status = write_file_atomic(probe, block);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  fs::remove(probe, ec);
  if (!status)
    return {"disk", status.error().where + ": " + status.error().found, other_folder, true,
            ErrorKind::device};
  const double mib_s = writes / seconds;
  std::string remedy = more_space;
  if (remedy.empty() && mib_s < 10) remedy = "record to a faster disk: cameras bring 20 MiB/s";
  return {"disk",
          fmt::format("{:.1f} GiB free, {:.0f} MiB/s in synced 1 MiB files", free_gib, mib_s),
          remedy, true, ErrorKind::device};
}

}  // namespace orbitfuse::doctor
