// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "app/cli/verb.hpp"
#include "core/cpu.hpp"
#include "core/file_io.hpp"
#include "core/parallel.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;

struct Finding {
  std::string what, found, remedy;  ///< remedy empty: fine
};

std::string on_path(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::error_code ec;
    const fs::path candidate = fs::path(folder) / program;
    const auto status = fs::status(candidate, ec);
    if (!ec && fs::is_regular_file(status) &&
        (status.permissions() & fs::perms::others_exec) != fs::perms::none)
      return candidate.string();
  }
  return {};
}

Finding check_colmap() {
  const std::string colmap = on_path("colmap");
  if (colmap.empty())
    return {"COLMAP", "not on PATH", "apt install colmap, or import sessions with known poses"};
  return {"COLMAP", colmap, ""};
}

Finding check_cpu() {
  return {"processor", fmt::format("{}, kernels for {}", cpu_description(), name(best_isa())),
          has_baseline() ? "" : "use a processor with AVX2"};
}

Finding check_memory() {
  std::ifstream info("/proc/meminfo");
  double available_gib = 0;
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("MemAvailable:"))
      available_gib = std::atof(line.c_str() + sizeof("MemAvailable:")) / (1024 * 1024);
  return {"memory", fmt::format("{:.1f} GiB available", available_gib),
          available_gib >= 2 ? "" : "close other programs: a run needs about 2 GiB"};
}

/// A run writes many small files and fsyncs each; a slow disk shows here first.
Finding check_disk(const fs::path& folder) {
  std::error_code ec;
  const auto space = fs::space(folder, ec);
  if (ec) return {"disk", ec.message(), "choose a folder that exists with --folder"};
  constexpr int writes = 20;
  const std::string block(1 << 20, 'x');
  const fs::path probe = folder / ".orbitfuse-doctor";
  const auto start = std::chrono::steady_clock::now();
  Status status;
  for (int i = 0; i < writes && status; ++i) status = write_file_atomic(probe, block);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  fs::remove(probe, ec);
  if (!status) return {"disk", status.error().message(), "choose a folder you can write to"};
  const double free_gib = static_cast<double>(space.available) / (1 << 30);
  const double mib_s = writes / seconds;
  std::string remedy;
  if (free_gib < 2) remedy = "free some space: a run needs about 2 GiB";
  else if (mib_s < 10) remedy = "record to a faster disk: cameras bring 20 MiB/s";
  return {"disk", fmt::format("{:.1f} GiB free, {:.0f} MiB/s in synced 1 MiB files", free_gib, mib_s),
          remedy};
}

Finding check_clock() {
  const auto now = std::chrono::system_clock::now();
  const bool set = now > std::chrono::sys_days{std::chrono::year{2024} / 1 / 1};
  return {"clock", fmt::format("{} s since 1970", std::chrono::duration_cast<std::chrono::seconds>(
                                                      now.time_since_epoch()).count()),
          set ? "" : "set the clock: frames are ordered by host time"};
}

}  // namespace

Action add_doctor(CLI::App& app) {
  const auto folder = std::make_shared<std::string>(".");
  app.add_option("--folder", *folder, "Where sessions and results will lie")->capture_default_str();
  return [folder](Context& context) -> Status {
    auto list = nlohmann::json::array();
    int problems = 0;
    for (const Finding& f : {check_cpu(), check_memory(), check_disk(*folder), check_colmap(),
                             check_clock()}) {
      context.console.data(fmt::format("{:<5}{:<10} {}{}", f.remedy.empty() ? "ok" : "FIX", f.what,
                                       f.found, f.remedy.empty() ? "" : "; " + f.remedy));
      list.push_back({{"what", f.what}, {"found", f.found}, {"remedy", f.remedy}});
      problems += !f.remedy.empty();
    }
    context.result = {{"findings", list}, {"threads", thread_count()}};
    if (problems > 0)
      return fail(ErrorKind::unavailable, "doctor", fmt::format("{} findings to fix", problems),
                  "see the lines marked FIX");
    return {};
  };
}

}  // namespace orbitfuse::cli
