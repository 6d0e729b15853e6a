// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/similarity.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <limits>

#include "core/formats/ply.hpp"
#include "tests/recon/registration/shapes.hpp"
#include "tests/support/shared_data.hpp"

namespace orbitfuse::registration {
namespace {

using namespace orbitfuse::testing;

Points applied(const Similarity3d& s, const Points& points) {
  Points out;
  for (const auto& p : points) out.push_back(s * p);
  return out;
}

void expect_same(const Similarity3d& found, const Similarity3d& truth, double tolerance,
                 double size = 1) {
  EXPECT_LT(rotation_angle_deg(found.rotation, truth.rotation), tolerance * 100);
  EXPECT_NEAR(found.scale / truth.scale, 1, tolerance);
  EXPECT_LT((found.translation - truth.translation).norm(), tolerance * size);
}

TEST(Umeyama, IsExactOnExactPairs) {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Points source =
        drawn(3 + trial, 10 + static_cast<std::uint32_t>(trial), on_potato).positions;
    const Similarity3d truth = any_similarity(random);
    const auto found = umeyama(source, applied(truth, source));
    ASSERT_TRUE(found) << found.error().message();
    expect_same(*found, truth, 1e-8, 10);
  }
}

TEST(Umeyama, IsStationaryOnNoisyPairs) {
  // Derivative check: no small similarity lowers the squared error of the answer.
  Random random(2);
  const Points source = drawn(40, 3, on_potato).positions;
  Points target = applied(any_similarity(random), source);
  for (auto& q : target) q += 0.1 * gaussian3(random);
  const auto found = umeyama(source, target);
  ASSERT_TRUE(found);
  const auto error = [&](const Similarity3d& s) {
    double sum = 0;
    for (std::size_t i = 0; i < source.size(); ++i)
      sum += (s * source[i] - target[i]).squaredNorm();
    return sum;
  };
  const double least = error(*found), step = 1e-4;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-step, step}) {
      Similarity3d turned = *found, shifted = *found, grown = *found;
      turned.rotation = (Eigen::Quaterniond(Eigen::AngleAxisd(sign, Eigen::Vector3d::Unit(axis))) *
                         turned.rotation)
                            .normalized();
      shifted.translation[axis] += sign;
      grown.scale *= 1 + sign;
      EXPECT_GE(error(turned), least);
      EXPECT_GE(error(shifted), least);
      EXPECT_GE(error(grown), least);
    }
  }
}

TEST(Umeyama, WeightsOfZeroRemovePairs) {
  Random random(3);
  Points source = drawn(20, 4, on_potato).positions;
  const Similarity3d truth = any_similarity(random);
  Points target = applied(truth, source);
  std::vector<double> weights(20, 1.0);
  for (std::size_t i = 0; i < 6; ++i) {
    target[i] += Eigen::Vector3d(50, -20, 9);
    weights[i] = 0;
  }
  const auto found = umeyama(source, target, weights);
  ASSERT_TRUE(found);
  expect_same(*found, truth, 1e-8, 10);
}

TEST(Umeyama, HoldsAtExtremeSizesAndOffsets) {
  Random random(4);
  const Points base = drawn(50, 5, on_potato).positions;
  for (const double size : {1e-6, 1.0, 1e6}) {
    Points source;
    for (const auto& p : base) source.push_back(size * p);
    const Similarity3d truth = any_similarity(random);
    const auto found = umeyama(source, applied(truth, source));
    ASSERT_TRUE(found) << size;
    expect_same(*found, truth, 1e-8, std::max(1.0, size));
  }
  // 1e6 across at 4e8: doubles keep 6e-8 there, 1e-13 of the size is lost.
  Points far;
  for (const auto& p : base) far.push_back(1e6 * p + Eigen::Vector3d(4e8, -4e8, 4e8));
  const Similarity3d truth = any_similarity(random);
  const auto found = umeyama(far, applied(truth, far));
  ASSERT_TRUE(found);
  for (const auto& p : far) EXPECT_LT((*found * p - truth * p).norm(), 1e-5);
}

TEST(Umeyama, CoplanarPairsDetermineTheSimilarity) {
  Random random(5);
  const Points source = drawn(30, 6, on_plane).positions;
  const Similarity3d truth = any_similarity(random);
  const auto found = umeyama(source, applied(truth, source));
  ASSERT_TRUE(found);
  expect_same(*found, truth, 1e-8, 10);
}

TEST(Umeyama, NeverReturnsAReflection) {
  const Points source = drawn(30, 7, on_potato).positions;
  Points mirrored = source;
  for (auto& p : mirrored) p.x() = -p.x();
  const auto found = umeyama(source, mirrored);
  if (!found) return;  // a typed refusal is an answer too
  EXPECT_NEAR(found->rotation.toRotationMatrix().determinant(), 1, 1e-9);
  EXPECT_GT(found->scale, 0);
  EXPECT_LT(found->scale, 1);
}

TEST(Umeyama, DegeneratePairsAreErrors) {
  const Points line = drawn(20, 8, on_line).positions, potato = drawn(20, 9, on_potato).positions;
  const Points one_place(20, Eigen::Vector3d(1, 2, 3));
  Points broken = potato;
  broken[7].y() = std::numeric_limits<double>::quiet_NaN();
  Points infinite = potato;
  infinite[3].x() = std::numeric_limits<double>::infinity();
  const auto is_input_error = [](const auto& result) {
    return !result && result.error().kind == ErrorKind::input;
  };
  EXPECT_TRUE(is_input_error(umeyama({}, {})));
  EXPECT_TRUE(is_input_error(umeyama({potato[0], potato[1]}, {potato[0], potato[1]})));
  EXPECT_TRUE(is_input_error(umeyama(line, potato)));
  EXPECT_TRUE(is_input_error(umeyama(potato, line)));
  EXPECT_TRUE(is_input_error(umeyama(one_place, potato)));
  EXPECT_TRUE(is_input_error(umeyama(potato, one_place)));
  EXPECT_TRUE(is_input_error(umeyama(broken, potato)));
  EXPECT_TRUE(is_input_error(umeyama(potato, infinite)));
  EXPECT_TRUE(is_input_error(umeyama(potato, Points(potato.begin(), potato.end() - 1))));
  EXPECT_TRUE(is_input_error(umeyama(potato, potato, std::vector<double>(20, 0.0))));
  EXPECT_TRUE(is_input_error(umeyama(potato, potato, std::vector<double>(20, -1.0))));
}

TEST(RobustUmeyama, DegeneratePairsAreErrors) {
  EXPECT_FALSE(robust_umeyama({}, {}, 0.1));
  const Points line = drawn(20, 8, on_line).positions;
  EXPECT_FALSE(robust_umeyama(line, line, 0.1));
  const Points potato = drawn(20, 9, on_potato).positions;
  const auto no_bound = robust_umeyama(potato, potato, 0);
  ASSERT_FALSE(no_bound);
  EXPECT_EQ(no_bound.error().kind, ErrorKind::usage);
}

TEST(RobustUmeyama, FindsTheSimilarityUnderHalfOutliers) {
  Random random(11);
  for (int trial = 0; trial < 10; ++trial) {
    const Points source = drawn(60, 20 + static_cast<std::uint32_t>(trial), on_potato).positions;
    const Similarity3d truth = any_similarity(random);
    Points target = applied(truth, source);
    for (std::size_t i = 0; i < 30; ++i) target[i] = truth * on_potato(random);
    const auto found = robust_umeyama(source, target, 1e-3);
    ASSERT_TRUE(found);
    expect_same(found->target_from_source, truth, 1e-4, 10);
    EXPECT_NEAR(found->inlier_ratio, 0.5, 0.05);
  }
}

/// The TEASER++ data sets: given correspondences, ground truth, up to 90 % outliers.
class TeaserData : public ::testing::TestWithParam<const char*> {};

template <int rows, int columns>
Eigen::Matrix<double, rows, columns> read_csv(const std::filesystem::path& path) {
  std::ifstream in(path);
  Eigen::Matrix<double, rows, columns> m;
  char comma;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      if (c > 0) in >> comma;
      in >> m(r, c);
    }
  }
  return m;
}

TEST_P(TeaserData, GncFindsTheReference) {
  const auto folder = shared_data() / "clouds" / GetParam();
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not here";
  const auto source = read_ply(folder / "src.ply"), target = read_ply(folder / "dst.ply");
  ASSERT_TRUE(source && target);
  ASSERT_EQ(source->size(), target->size());
  const auto found = robust_umeyama(source->positions, target->positions, 0.02);
  ASSERT_TRUE(found) << found.error().message();
  const Eigen::Quaterniond rotation(read_csv<3, 3>(folder / "R_ref.csv"));
  EXPECT_LT(rotation_angle_deg(found->target_from_source.rotation, rotation), 0.1);
  EXPECT_NEAR(found->target_from_source.scale, (read_csv<1, 1>(folder / "s_ref.csv")(0, 0)), 2e-3);
  EXPECT_LT((found->target_from_source.translation - read_csv<3, 1>(folder / "t_ref.csv")).norm(),
            5e-3);
}
INSTANTIATE_TEST_SUITE_P(All, TeaserData,
                         ::testing::Values("benchmark_1", "benchmark_2", "benchmark_3",
                                           "benchmark_4"));

}  // namespace
}  // namespace orbitfuse::registration
