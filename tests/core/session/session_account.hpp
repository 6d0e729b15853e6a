// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "core/session/session.hpp"

namespace orbitfuse::test {

/// Each id of each device is either a frame's or in a gap, exactly once, from the first to the
/// last.
inline void expect_each_id_once(const Session& session) {
  std::map<std::string, std::map<std::uint64_t, int>> times;
  for (const FrameRecord& f : session.frames) ++times[f.device][f.sequence];
  for (const GapRecord& g : session.gaps) {
    for (std::uint64_t i = 0; i < g.count; ++i) ++times[g.device][g.first_sequence + i];
  }
  for (const auto& [device, ids] : times) {
    std::uint64_t expected = ids.begin()->first;
    for (const auto& [id, count] : ids) {
      EXPECT_EQ(id, expected) << device << ": ids before it are unaccounted for";
      EXPECT_EQ(count, 1) << device << ": id " << id;
      expected = id + 1;
    }
  }
}

}  // namespace orbitfuse::test
