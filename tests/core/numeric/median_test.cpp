// SPDX-License-Identifier: BSD-3-Clause
#include "core/numeric/median.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace orbitfuse {
namespace {

TEST(Median, OfAnEvenNumberItIsTheUpperMiddle) {
  EXPECT_EQ(median({4, 1, 3, 2}), 3);
  EXPECT_EQ(median({5, 1, 3}), 3);
  EXPECT_EQ(median({7}), 7);
}

TEST(Median, AQuantileIsTheSampleOfItsRank) {
  std::vector<float> values;
  for (int i = 0; i < 101; ++i) values.push_back(static_cast<float>((37 * i) % 101));
  for (const double share : {0.0, 0.25, 0.5, 0.98, 1.0})
    EXPECT_EQ(quantile(values, share), static_cast<float>(100 * share));
  std::vector<std::uint16_t> two{9, 4};
  EXPECT_EQ(quantile(two, 0.5), 4) << "the rank is rounded down";
  EXPECT_EQ(median_in(two), 9);
}

TEST(Median, OfNothingIsZero) {
  std::vector<double> none;
  EXPECT_EQ(median(none), 0);
  EXPECT_EQ(median_in(none), 0);
  EXPECT_EQ(quantile(none, 0.9), 0);
}

}  // namespace
}  // namespace orbitfuse
