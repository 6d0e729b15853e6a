// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/timex.h>

#include <chrono>

#include "app/doctor/checks.hpp"

namespace orbitfuse::doctor {
namespace {

bool kernel_clock_synchronised() {
  timex state{};
  return adjtimex(&state) != TIME_ERROR && !(state.status & STA_UNSYNC);
}

}  // namespace

std::vector<Finding> check_clocks(const Machine& machine) {
  const auto now = std::chrono::system_clock::now();
  const bool set = now > std::chrono::sys_days{std::chrono::year{2024} / 1 / 1};
  std::error_code ignored;
  const bool kept =
      machine.clock_synchronised.value_or(kernel_clock_synchronised()) ||
      std::filesystem::exists(machine.root / "run/systemd/timesync/synchronized", ignored);
  return {
      {"clock",
       fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::chrono::system_clock::to_time_t(now))),
       set ? "" : "set the clock: frames are ordered by host time", true},
      {"time service", kept ? "keeps the clock" : "none keeps the clock",
       kept ? "" : "for two cameras on two computers: timedatectl set-ntp true, or install chrony",
       false}};
}

}  // namespace orbitfuse::doctor
