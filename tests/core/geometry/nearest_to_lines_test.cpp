// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/nearest_to_lines.hpp"

#include <gtest/gtest.h>

namespace orbitfuse {
namespace {

TEST(NearestToLines, IsWhereTheyCrossWhateverTheirScale) {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    const Eigen::Vector3d target = scale * Eigen::Vector3d(1, -2, 3);
    NearestToLines lines;
    for (const Eigen::Vector3d& d :
         {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0.6, 0.8, 0), Eigen::Vector3d(0, 0.6, -0.8)})
      lines.add(target + 7 * scale * d, d);
    EXPECT_GT(lines.crossing(), 0.05);
    EXPECT_LT((lines.point() - target).norm(), 1e-12 * scale);
  }
}

TEST(NearestToLines, AWeightDrawsIt) {
  NearestToLines lines;  // two that pass each other along x and y, one above the other
  lines.add({0, 0, 0}, {1, 0, 0}, 3);
  lines.add({0, 0, 4}, {0, 1, 0}, 1);
  EXPECT_LT((lines.point() - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12);
}

TEST(NearestToLines, ParallelLinesAndNoneCrossNowhere) {
  NearestToLines lines;
  EXPECT_EQ(lines.crossing(), 0);
  for (int i = 0; i < 5; ++i) lines.add({0, 1.0 * i, 0}, {1, 0, 0});
  EXPECT_LT(lines.crossing(), 1e-12);
}

}  // namespace
}  // namespace orbitfuse
