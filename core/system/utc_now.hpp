// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <cstdint>
#include <ctime>
#include <string>

namespace orbitfuse {

/// Nanoseconds since the UTC epoch, as frames and events are stamped.
inline std::int64_t utc_now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// "2026-11-24T21:36:05Z", as files say when they were made.
inline std::string utc_now_text() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
}

}  // namespace orbitfuse
