// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/rotation_vector.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace orbitfuse {
namespace {

TEST(RotationVector, TurnsByItsLengthAboutItself) {
  const Eigen::Quaterniond quarter = turned_by({0, 0, std::numbers::pi / 2});
  EXPECT_LT((quarter * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);
  const Eigen::Vector3d about(0.3, -1.2, 0.4);
  EXPECT_LT((turned_by(about) * about - about).norm(), 1e-15);
  EXPECT_LT((turned_by(about) * turned_by(-about)).vec().norm(), 1e-15);
}

TEST(RotationVector, OfAnyLengthIsARotation) {
  for (const double length : {0.0, 1e-320, 1e-160, 1e-30, 1e-8, 1.0, 1e3, 1e12}) {
    const Eigen::Quaterniond turn = turned_by(length * Eigen::Vector3d(0.6, 0, 0.8));
    EXPECT_NEAR(turn.norm(), 1, 1e-12) << length;
  }
  const Eigen::Quaterniond small = turned_by({1e-9, 0, 0});
  EXPECT_NEAR(small.x(), 5e-10, 1e-24);
}

}  // namespace
}  // namespace orbitfuse
