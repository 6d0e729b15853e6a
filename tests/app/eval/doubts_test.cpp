// SPDX-License-Identifier: BSD-3-Clause
#include "app/eval/doubts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace orbitfuse::eval {
namespace {
using ::testing::HasSubstr;

/// Views of a walk round an object, at uneven steps and heights.
std::vector<PosePair> walk() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uneven(-0.2, 0.2);
  std::vector<PosePair> pairs;
  for (int i = 0; i < 12; ++i) {
    const double a = (i + uneven(random)) * std::numbers::pi / 6;
    const Eigen::Vector3d eye(5 * std::cos(a), 5 * std::sin(a), 1 + 3 * uneven(random));
    const Eigen::Quaterniond q(Eigen::AngleAxisd(a + 1, Eigen::Vector3d::UnitZ()));
    const Rigid3d pose{q.conjugate(), -(q.conjugate() * eye)};
    pairs.push_back({pose, pose});
  }
  return pairs;
}

std::optional<std::string> doubt(const std::vector<PosePair>& pairs) {
  return doubt_of_truth(pairs, pose_error(pairs, truth_from_estimate(pairs).value()));
}

TEST(DoubtOfTruth, RightPosesLeaveNone) { EXPECT_EQ(doubt(walk()), std::nullopt); }

TEST(DoubtOfTruth, AnotherOrderIsNamed) {
  const std::vector<PosePair> right = walk();
  std::vector<PosePair> backwards = right, mixed = right;
  for (std::size_t i = 0; i < right.size(); ++i) {
    backwards[i].cam_from_truth = right[right.size() - 1 - i].cam_from_truth;
    mixed[i].cam_from_truth = right[(5 * i + 3) % right.size()].cam_from_truth;
  }
  const auto said = doubt(backwards);
  ASSERT_TRUE(said);
  EXPECT_THAT(*said, HasSubstr("with the truth's poses in the opposite order they are 0.00 % off"));
  const auto unexplained = doubt(mixed);
  ASSERT_TRUE(unexplained);
  EXPECT_THAT(*unexplained, HasSubstr("the truth is of another scene or in another order"));
  EXPECT_EQ(unexplained->find("with the truth's"), std::string::npos);
}

TEST(DoubtOfTruth, AShiftedOrderIsNamed) {
  const std::vector<PosePair> right = walk();
  std::vector<PosePair> shifted = right;
  for (std::size_t i = 0; i < right.size(); ++i)
    shifted[i].cam_from_truth = right[(i + 4) % right.size()].cam_from_truth;
  const auto said = doubt(shifted);
  ASSERT_TRUE(said);
  EXPECT_THAT(*said,
              HasSubstr("with the truth's poses 8 posed frames further on they are 0.00 % off"));
}

TEST(DoubtOfTestViews, OnlyWhereTheyAreMuchWorse) {
  EXPECT_EQ(doubt_of_test_views(25, 28), std::nullopt);
  EXPECT_EQ(doubt_of_test_views(28, 25), std::nullopt);
  EXPECT_EQ(doubt_of_test_views(11, std::nan("")), std::nullopt);
  EXPECT_THAT(doubt_of_test_views(13, 28).value(), HasSubstr("13.0 dB"));
}

}  // namespace
}  // namespace orbitfuse::eval
