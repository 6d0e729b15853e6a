// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/descriptor_matching.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace orbitfuse {
namespace {

/// COLMAP's bytes of random root-SIFT-like descriptors.
Descriptors random_descriptors(int rows, unsigned seed) {
  std::mt19937 random(seed);
  std::exponential_distribution<float> size(1.0F);
  Descriptors result(rows, 128);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < 128; ++c) result(r, c) = size(random);
    result.row(r) = (512 * result.row(r).normalized()).array().round();
  }
  return result;
}

/// Some rows of `from` in another order, with noise.
Descriptors seen_again(const Descriptors& from, unsigned seed, float noise) {
  std::mt19937 random(seed);
  std::normal_distribution<float> shift(0, noise);
  Descriptors result = random_descriptors(static_cast<int>(from.rows()), seed + 1);
  for (Eigen::Index r = 0; r + 7 < from.rows(); r += 2)
    for (Eigen::Index c = 0; c < 128; ++c)
      result(r + 7, c) = std::clamp(std::round(from(r, c) + shift(random)), 0.0F, 255.0F);
  return result;
}

/// The definition, in double, pair by pair.
std::vector<FeatureMatch> by_definition(const Descriptors& a, const Descriptors& b,
                                        const DescriptorMatchOptions& options) {
  const auto best_of = [&](const Descriptors& from, Eigen::Index r, const Descriptors& to) {
    double best = 1e9, second = 1e9;
    int index = -1;
    for (Eigen::Index c = 0; c < to.rows(); ++c) {
      const double cosine =
          from.row(r).cast<double>().dot(to.row(c).cast<double>()) / (512.0 * 512.0);
      const double angle = std::acos(std::clamp(cosine, 0.0, 1.0));
      if (angle < best)
        second = best, best = angle, index = static_cast<int>(c);
      else
        second = std::min(second, angle);
    }
    const bool good = index >= 0 && best <= options.max_distance_rad &&
                      (to.rows() < 2 || best < options.max_ratio * second);
    return good ? index : -1;
  };
  std::vector<FeatureMatch> matches;
  for (Eigen::Index r = 0; r < a.rows(); ++r) {
    const int c = best_of(a, r, b);
    if (c >= 0 && best_of(b, c, a) == r) matches.emplace_back(static_cast<int>(r), c);
  }
  return matches;
}

TEST(DescriptorMatching, IsTheDefinition) {
  for (const int rows : {1, 9, 63, 64, 65, 200}) {
    const Descriptors a = random_descriptors(rows, 3), b = seen_again(a, 5, 12);
    EXPECT_EQ(match_descriptors(a, b), by_definition(a, b, {})) << rows;
  }
}

TEST(DescriptorMatching, FindsWhatWasSeenAgain) {
  const Descriptors a = random_descriptors(300, 7), b = seen_again(a, 11, 6);
  const auto matches = match_descriptors(a, b);
  EXPECT_GE(matches.size(), 140u);  // of 147
  for (const auto& [i, j] : matches) EXPECT_EQ(j, i + 7);
}

TEST(DescriptorMatching, EqualTwinsAreNoMatch) {
  Descriptors a = random_descriptors(20, 13), b = a;
  b.row(5) = b.row(4);
  for (const auto& [i, j] : match_descriptors(a, b)) {
    EXPECT_NE(i, 4);
    EXPECT_EQ(i, j);
  }
  EXPECT_EQ(match_descriptors(a, b).size(),
            18u);  // without 4, whose twins tie, and 5, which is gone
}

TEST(DescriptorMatching, EmptyAndBlankSetsMatchNothing) {
  const Descriptors none(0, 128), some = random_descriptors(4, 1),
                                  blank = Descriptors::Zero(4, 128);
  EXPECT_TRUE(match_descriptors(none, some).empty());
  EXPECT_TRUE(match_descriptors(some, none).empty());
  EXPECT_TRUE(match_descriptors(none, none).empty());
  EXPECT_TRUE(match_descriptors(blank, blank).empty());
  EXPECT_TRUE(match_descriptors(some, blank).empty());
}

TEST(DescriptorMatching, AViewWithoutFeaturesMatchesNothing) {
  const Descriptors none, some = Descriptors::Constant(5, 128, 45);
  EXPECT_TRUE(match_descriptors(none, some).empty());
  EXPECT_TRUE(match_descriptors(some, none).empty());
  EXPECT_TRUE(match_descriptors(none, none).empty());
}

}  // namespace
}  // namespace orbitfuse
