// SPDX-License-Identifier: BSD-3-Clause
#include "core/numeric/bilinear.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace orbitfuse {
namespace {

constexpr int columns = 4, rows = 3;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

double plane(double x, double y) { return 3 * x - 2 * y + 1; }
double sample(int row, int column) { return plane(column, row); }

TEST(Bilinear, OfAPlaneIsThePlane) {
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {0.25, 1.75}, {2.999, 0.5}, {1.0, 1.0}}) {
    const auto place = place_among<double>(columns, rows, x, y);
    ASSERT_TRUE(place) << x << ' ' << y;
    EXPECT_NEAR(blended(*place, sample), plane(x, y), 1e-12);
    EXPECT_NEAR(blended(place_held<double>(columns, rows, x, y), sample), plane(x, y), 1e-12);
  }
}

TEST(Bilinear, AmongTheCentresEndsBeforeTheLast) {
  for (const auto& [x, y] : {std::pair{-1e-9, 1.0},
                             {1.0, -1e-9},
                             {3.0, 1.0},
                             {1.0, 2.0},
                             {nan, 1.0},
                             {1.0, nan},
                             {1e300, 1.0}})
    EXPECT_FALSE(place_among<float>(columns, rows, x, y)) << x << ' ' << y;
  EXPECT_TRUE(place_among<float>(columns, rows, std::nextafter(3.0F, 0.0F), 1.0F));
  EXPECT_FALSE(place_among<float>(1, rows, 0.0F, 0.0F));
}

TEST(Bilinear, HeldValuesAreTheOutermost) {
  const auto at = [&](double x, double y) {
    return blended(place_held<double>(columns, rows, x, y), sample);
  };
  EXPECT_EQ(at(-7, 1), plane(0, 1));
  EXPECT_EQ(at(99, 1), plane(3, 1));
  EXPECT_EQ(at(3, 2), plane(3, 2));
  EXPECT_EQ(at(1, -0.5), plane(1, 0));
  EXPECT_EQ(blended(place_held<double>(1, 1, 5, 5), sample), plane(0, 0));
}

TEST(Bilinear, IsNotANumberWhereASampleIsNot) {
  const auto holed = [](int row, int column) {
    return row == 1 && column == 1 ? nan : sample(row, column);
  };
  EXPECT_TRUE(std::isnan(blended(*place_among<double>(columns, rows, 0.5, 0.5), holed)));
  EXPECT_TRUE(std::isnan(blended(*place_among<double>(columns, rows, 0.0, 0.0), holed)))
      << "though it weighs nothing";
  EXPECT_FALSE(std::isnan(blended(*place_among<double>(columns, rows, 2.5, 0.5), holed)));
  EXPECT_FALSE(std::isnan(blended(place_held<double>(columns, rows, 3, 2), holed)));
}

}  // namespace
}  // namespace orbitfuse
