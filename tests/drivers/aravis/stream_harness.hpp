// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "drivers/aravis/aravis_source.hpp"
#include "tests/support/gev_simulator.hpp"

namespace orbitfuse::aravis {

using testing_clock = std::chrono::steady_clock;

/// Runs a source against the simulator and counts what it says.
struct Tally {
  std::uint64_t frames = 0, rejected = 0, wrong_bits = 0, not_rising = 0, first_id = 0, last_id = 0;
  std::vector<std::string> events, details;  ///< details: of reconnections
  std::ptrdiff_t times(const char* event) const {
    return std::count(events.begin(), events.end(), event);
  }
  std::int64_t last_host_ns = 0, first_device_ns = 0, last_device_ns = 0;
  std::uint64_t first_frame_id = 0, last_frame_id = 0;
  /// Frame numbers less ids, modulo 4001: the same for all frames of a connection.
  std::optional<std::uint64_t> shift;
  double rate_hz() const {
    return 1e9 * static_cast<double>(last_frame_id - first_frame_id) /
           static_cast<double>(last_device_ns - first_device_ns);
  }
  bool has(const std::string& event) const {
    return std::find(events.begin(), events.end(), event) != events.end();
  }
  std::uint64_t span() const { return frames + rejected == 0 ? 0 : last_id - first_id + 1; }
};

/// The number of the simulator's frame that this one holds bit by bit, modulo 4001.
inline std::optional<std::uint64_t> number_of(const Frame& frame) {
  const auto* p = frame.pixels.ptr<std::uint16_t>();
  // Content repeats with the number modulo 4001; the first pixel tells which it is.
  for (std::uint64_t number = 0; number < 4001; ++number) {
    if (orbitfuse::testing::GevSimulator::pixel(number, 0) != p[0]) continue;
    for (std::size_t i = 0; i < frame.pixels.total(); ++i) {
      if (p[i] != orbitfuse::testing::GevSimulator::pixel(number, i)) return std::nullopt;
    }
    return number;
  }
  return std::nullopt;
}

/// Delivers until `enough` says so or the time is up.
inline Tally drain(AravisSource& source, std::chrono::milliseconds limit,
                   const std::function<bool(const Tally&)>& enough = {}) {
  Tally tally;
  const auto end = testing_clock::now() + limit;
  while (testing_clock::now() < end && !(enough && enough(tally))) {
    const Result<Delivery> delivery = source.next(std::chrono::milliseconds(200));
    EXPECT_TRUE(delivery);
    if (!delivery) break;
    const bool counted =
        delivery->kind == Delivery::Kind::frame || delivery->kind == Delivery::Kind::rejected;
    if (counted) {
      if (tally.frames + tally.rejected == 0)
        tally.first_id = delivery->frame.id;
      else if (delivery->frame.id <= tally.last_id)
        ++tally.not_rising;
      tally.last_id = delivery->frame.id;
    }
    if (delivery->kind == Delivery::Kind::frame) {
      ++tally.frames;
      const Frame& frame = delivery->frame;
      const std::optional<std::uint64_t> number = number_of(frame);
      const std::uint64_t shift = number ? (*number + 4001 - frame.id % 4001) % 4001 : 0;
      if (!number || shift != tally.shift.value_or(shift)) ++tally.wrong_bits;
      if (number) tally.shift = shift;
      if (tally.first_device_ns == 0) {
        tally.first_device_ns = frame.device_time_ns.value_or(0);
        tally.first_frame_id = frame.id;
      }
      tally.last_device_ns = frame.device_time_ns.value_or(0);
      tally.last_frame_id = frame.id;
      const std::int64_t host_ns = frame.host_time_ns.value_or(0);
      if (host_ns <= tally.last_host_ns) ++tally.not_rising;
      tally.last_host_ns = host_ns;
    } else if (delivery->kind == Delivery::Kind::rejected) {
      ++tally.rejected;
    } else if (delivery->kind == Delivery::Kind::event) {
      tally.events.push_back(delivery->reason);
      if (delivery->event == EventKind::reconnected) tally.details.push_back(delivery->detail);
      if (delivery->event == EventKind::reconnected) tally.shift.reset();
    }
  }
  return tally;
}

}  // namespace orbitfuse::aravis
