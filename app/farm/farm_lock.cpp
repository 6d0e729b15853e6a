// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/farm_lock.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/farm/stage_job.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::farm {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

std::string first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

std::string boot_id() { return first_line("/proc/sys/kernel/random/boot_id"); }

/// Clock ticks since boot at which the process started; tells it from a later one with its number.
/// Empty: no such process.
std::string start_ticks(long pid) {
  std::string line = first_line(fmt::format("/proc/{}/stat", pid));
  const std::size_t name_end = line.rfind(')');
  if (name_end == std::string::npos) return {};
  std::istringstream words(line.substr(name_end + 1));
  std::string word;
  constexpr int start_field = 20;  // proc(5): field 22, two lie before
  for (int i = 0; i < start_field; ++i) words >> word;
  return word;
}

json holder_of(const fs::path& file) {
  const auto text = read_file(file, max_settings_bytes);
  return text ? parse_json(*text) : json();
}

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// Slurm starts a job again, with a higher count, once it has given up the node it was on.
bool is_our_earlier_start(const json& holder) {
  const std::string job = variable("SLURM_JOB_ID");
  return !job.empty() && holder.value("job", "") == job &&
         std::atoi(holder.value("restarts", "").c_str()) <
             std::atoi(variable("SLURM_RESTART_COUNT").c_str());
}

bool is_dead(const json& holder) {
  try {
    if (holder.at("host") != host_name()) return is_our_earlier_start(holder);
    return holder.at("boot") != boot_id() || holder.at("start") != start_ticks(holder.at("pid"));
  } catch (const json::exception&) {
    return false;  // cut off or foreign: nobody to ask
  }
}

}  // namespace

FarmLock::~FarmLock() {
  std::error_code ignored;
  if (!file_.empty()) fs::remove(file_, ignored);
}

bool FarmLock::is_free(const fs::path& out) {
  std::error_code unreadable;
  const fs::path file = out / "farm.lock";
  if (!fs::exists(file, unreadable)) return !unreadable;
  const json holder = holder_of(file);
  return holder.is_object() && is_dead(holder);
}

Status FarmLock::acquire(const fs::path& out) {
  const fs::path file = out / "farm.lock";
  const fs::path mine = out / fmt::format(".farm.lock.{}.{}", host_name(), getpid());
  const json me = {{"host", host_name()},
                   {"boot", boot_id()},
                   {"pid", getpid()},
                   {"start", start_ticks(getpid())},
                   {"job", variable("SLURM_JOB_ID")},
                   {"restarts", variable("SLURM_RESTART_COUNT")}};
  ORBITFUSE_TRY(write_file_atomic(mine, me.dump() + "\n"));
  std::error_code ignored;
  for (int attempt = 0; attempt < 2; ++attempt) {
    const int error = link(mine.c_str(), file.c_str()) == 0 ? 0 : errno;
    if (error == 0) {
      fs::remove(mine, ignored);
      file_ = file;
      return {};
    }
    if (error != EEXIST) {
      fs::remove(mine, ignored);
      return fail(ErrorKind::device, file.string(), std::strerror(error),
                  "choose a folder you can write to with --out");
    }
    const json holder = holder_of(file);
    if (attempt > 0 || !is_dead(holder)) {
      fs::remove(mine, ignored);
      const bool known = holder.is_object() && holder.contains("host") && holder.contains("pid");
      return fail(ErrorKind::usage, out.string(),
                  known ? fmt::format("another farm works in it: process {} on {}",
                                      holder["pid"].dump(), holder["host"].dump())
                        : "another farm works in it",
                  fmt::format("wait for it, or choose another --out; if that one is gone: rm {}",
                              file.string()));
    }
    // Renamed aside under a name of our own: of two that find the same dead holder one takes it.
    const fs::path stale = out / fmt::format(".farm.stale.{}.{}", host_name(), getpid());
    fs::rename(file, stale, ignored);
    if (holder_of(stale) != holder)  // somebody was quicker, and this is their lock
      (void)link(stale.c_str(), file.c_str());
    fs::remove(stale, ignored);
  }
  return {};
}

}  // namespace orbitfuse::farm
