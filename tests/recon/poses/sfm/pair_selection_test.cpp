// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/pair_selection.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace orbitfuse {
namespace {

std::vector<FrameRecord> two_loops(int per_loop, bool stations) {
  std::vector<FrameRecord> frames(static_cast<std::size_t>(2 * per_loop));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!stations) continue;
    Station station;
    station.loop = static_cast<int>(i) / per_loop;
    station.index = static_cast<int>(i) % per_loop;
    station.azimuth_deg = 360.0 * station.index / per_loop;
    station.elevation_deg = 15.0 + 20.0 * station.loop;
    frames[i].station = station;
  }
  return frames;
}

std::vector<const FrameRecord*> pointers(const std::vector<FrameRecord>& frames) {
  std::vector<const FrameRecord*> result;
  for (const FrameRecord& f : frames) result.push_back(&f);
  return result;
}

bool connected(int count, const std::vector<ViewPair>& pairs) {
  std::vector<int> root(static_cast<std::size_t>(count));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int i) {
    while (root[static_cast<std::size_t>(i)] != i) i = root[static_cast<std::size_t>(i)];
    return i;
  };
  for (const auto& [i, j] : pairs) root[static_cast<std::size_t>(find(i))] = find(j);
  for (int i = 0; i < count; ++i)
    if (find(i) != find(0)) return false;
  return true;
}

class OrbitPairs : public testing::TestWithParam<std::pair<int, bool>> {};

TEST_P(OrbitPairs, AtMostAFifthConnectedAndNobodyAlone) {
  const auto [per_loop, stations] = GetParam();
  const auto frames = two_loops(per_loop, stations);
  const int count = static_cast<int>(frames.size());
  const auto pairs = orbit_pairs(pointers(frames));
  EXPECT_LE(pairs.size() * 5, exhaustive_pairs(count).size());
  EXPECT_TRUE(connected(count, pairs));
  std::vector<int> partners(frames.size(), 0);
  for (const auto& [i, j] : pairs) {
    ASSERT_LT(i, j);
    ++partners[static_cast<std::size_t>(i)];
    ++partners[static_cast<std::size_t>(j)];
  }
  EXPECT_GE(*std::min_element(partners.begin(), partners.end()), 2);
}

INSTANTIATE_TEST_SUITE_P(Orbits, OrbitPairs,
                         testing::Values(std::pair{12, true}, std::pair{12, false},
                                         std::pair{25, true}, std::pair{25, false}));

TEST(OrbitPairs, StationsGiveNeighboursTheClosureAndTheOtherLoop) {
  const auto frames = two_loops(12, true);
  const auto pairs = orbit_pairs(pointers(frames));
  const auto has = [&](ViewPair p) {
    return std::find(pairs.begin(), pairs.end(), p) != pairs.end();
  };
  EXPECT_TRUE(has({0, 1}));
  EXPECT_TRUE(has({0, 11}));
  EXPECT_TRUE(has({0, 12}));
  EXPECT_FALSE(has({0, 6}));
}

TEST(OrbitPairs, OfTooManyTheNearestAreTaken) {
  const auto frames = two_loops(12, false);
  const auto few = nearest_pairs(pointers(frames), 48), all = nearest_pairs(pointers(frames), 1000);
  EXPECT_EQ(few.size(), 48u);
  EXPECT_EQ(all, exhaustive_pairs(24));
  for (int f = 0; f < 24; ++f) {  // the two before and after it, round the end
    const ViewPair next = std::minmax(f, (f + 1) % 24), second = std::minmax(f, (f + 2) % 24);
    EXPECT_EQ(std::count(few.begin(), few.end(), next), 1) << f;
    EXPECT_EQ(std::count(few.begin(), few.end(), second), 1) << f;
  }
}

TEST(OrbitPairs, FewViewsAreMatchedExhaustively) {
  for (const int per_loop : {4, 5}) {
    const auto frames = two_loops(per_loop, true);
    EXPECT_EQ(orbit_pairs(pointers(frames)), exhaustive_pairs(2 * per_loop));
  }
  EXPECT_TRUE(orbit_pairs({}).empty());
}

}  // namespace
}  // namespace orbitfuse
