// SPDX-License-Identifier: BSD-3-Clause
#include "core/numeric/percent.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace orbitfuse {
namespace {

TEST(Percent, OnlyNothingIsNothingAndOnlyAllIsAll) {
  EXPECT_EQ(percent(0), "0 %");
  EXPECT_EQ(percent(1e-9), "under 1 %");
  EXPECT_EQ(percent(0.0049), "under 1 %");
  EXPECT_EQ(percent(0.006), "1 %");
  EXPECT_EQ(percent(0.37), "37 %");
  EXPECT_EQ(percent(0.994), "99 %");
  EXPECT_EQ(percent(0.9951), "over 99 %");
  EXPECT_EQ(percent(1 - 1e-12), "over 99 %");
  EXPECT_EQ(percent(1), "100 %");
  EXPECT_EQ(percent(std::numeric_limits<double>::quiet_NaN()), "unknown");
  EXPECT_EQ(percent(std::numeric_limits<double>::infinity()), "unknown");
}

}  // namespace
}  // namespace orbitfuse
