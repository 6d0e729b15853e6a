// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <chrono>

#include "app/doctor/checks.hpp"
#include "core/file_io.hpp"

namespace orbitfuse::doctor {

/// A run writes many small files and fsyncs each; a slow disk shows here first.
Finding check_disk(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::error_code ec;
  const auto space = fs::space(folder, ec);
  if (ec)
    return {"disk", folder.string() + ": " + ec.message(), "choose a folder that exists with --folder", true,
            ErrorKind::input};
  if (!fs::is_directory(folder, ec))
    return {"disk", folder.string() + ": is not a folder", "choose a folder with --folder", true,
            ErrorKind::input};
  constexpr int writes = 20;
  const std::string block(1 << 20, 'x');
  const fs::path probe = folder / ".orbitfuse-doctor";
  const auto start = std::chrono::steady_clock::now();
  Status status;
  for (int i = 0; i < writes && status; ++i) status = write_file_atomic(probe, block);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  fs::remove(probe, ec);
  if (!status) return {"disk", status.error().where + ": " + status.error().found, "choose a folder you can write to", true, ErrorKind::device};
  const double free_gib = static_cast<double>(space.available) / (1 << 30);
  const double mib_s = writes / seconds;
  std::string remedy;
  if (free_gib < 2)
    remedy = "free some space: a run needs about 2 GiB";
  else if (mib_s < 10)
    remedy = "record to a faster disk: cameras bring 20 MiB/s";
  return {"disk",
          fmt::format("{:.1f} GiB free, {:.0f} MiB/s in synced 1 MiB files", free_gib, mib_s),
          remedy, true, ErrorKind::device};
}

}  // namespace orbitfuse::doctor
