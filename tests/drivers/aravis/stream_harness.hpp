// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
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
  std::vector<std::string> events;
  std::int64_t last_host_ns = 0;
  bool has(const std::string& event) const {
    return std::find(events.begin(), events.end(), event) != events.end();
  }
  std::uint64_t span() const { return frames + rejected == 0 ? 0 : last_id - first_id + 1; }
};

/// Does the frame hold, bit by bit, what the simulator sends as some frame? With `exact` its number
/// must be the id.
inline bool bits_right(const Frame& frame) {
  const auto* p = frame.pixels.ptr<std::uint16_t>();
  // Content repeats with the number modulo 4001; the first pixel tells which it is.
  for (std::uint64_t number = 0; number < 4001; ++number) {
    if (orbitfuse::testing::GevSimulator::pixel(number, 0) != p[0]) continue;
    for (std::size_t i = 0; i < frame.pixels.total(); ++i) {
      if (p[i] != orbitfuse::testing::GevSimulator::pixel(number, i)) return false;
    }
    return true;
  }
  return false;
}

/// Delivers until `enough` says so or the time is up.
inline Tally drain(AravisSource& source, std::chrono::milliseconds limit, const std::function<bool(const Tally&)>& enough = {}) {
  Tally tally;
  const auto end = testing_clock::now() + limit;
  while (testing_clock::now() < end && !(enough && enough(tally))) {
    const Result<Delivery> delivery = source.next(std::chrono::milliseconds(200));
    EXPECT_TRUE(delivery);
    if (!delivery) break;
    const bool counted = delivery->kind == Delivery::Kind::frame || delivery->kind == Delivery::Kind::rejected;
    if (counted) {
      if (tally.frames + tally.rejected == 0) tally.first_id = delivery->frame.id;
      else if (delivery->frame.id <= tally.last_id) ++tally.not_rising;
      tally.last_id = delivery->frame.id;
    }
    if (delivery->kind == Delivery::Kind::frame) {
      ++tally.frames;
      if (!bits_right(delivery->frame)) ++tally.wrong_bits;
      if (delivery->frame.host_time_ns <= tally.last_host_ns) ++tally.not_rising;
      tally.last_host_ns = delivery->frame.host_time_ns;
    } else if (delivery->kind == Delivery::Kind::rejected) {
      ++tally.rejected;
    } else if (delivery->kind == Delivery::Kind::event) {
      tally.events.push_back(delivery->reason);
    }
  }
  return tally;
}

}  // namespace orbitfuse::aravis
