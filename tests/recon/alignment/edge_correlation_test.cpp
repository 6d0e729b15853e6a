// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/edge_correlation.hpp"

#include <gtest/gtest.h>

namespace orbitfuse {
namespace {

cv::Mat noise_field(cv::Size size, int seed) {
  cv::Mat field(size, CV_32FC2);
  cv::RNG(static_cast<std::uint64_t>(seed)).fill(field, cv::RNG::UNIFORM, -1, 1);
  return field;
}

/// The definition: every shift on its own, pixels in their order.
float summed(const std::vector<EdgePixel>& pixels, const cv::Mat& field, int dx, int dy) {
  float sum = 0;
  for (const EdgePixel& p : pixels) {
    const int x = p.x + dx, y = p.y + dy;
    if (x < 0 || y < 0 || x >= field.cols || y >= field.rows) continue;
    const auto& v = field.at<cv::Vec2f>(y, x);
    sum += p.re * v[0] + p.im * v[1];
  }
  return sum;
}

TEST(EdgeCorrelation, EveryShiftIsTheSumOverItsPixels) {
  const cv::Mat field = noise_field({37, 23}, 3);
  const std::vector<EdgePixel> pixels = edge_pixels(noise_field({37, 23}, 4), 0.7F);
  ASSERT_GT(pixels.size(), 50U);
  for (const int reach : {0, 3, 4, 7, 14, 30}) {
    const FieldPlanes planes(field, reach + 9);
    for (const cv::Point at : {cv::Point(0, 0), cv::Point(9, -5), cv::Point(-7, 8)}) {
      const cv::Mat1f score = planes.correlation(pixels, at.x, at.y, reach);
      ASSERT_EQ(score.size(), cv::Size(2 * reach + 1, 2 * reach + 1));
      for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx)
          ASSERT_EQ(score(dy + reach, dx + reach), summed(pixels, field, at.x + dx, at.y + dy))
              << "reach " << reach << ", shift " << at.x + dx << " " << at.y + dy;
    }
  }
}

TEST(EdgeCorrelation, NothingGivesZero) {
  const FieldPlanes planes(noise_field({8, 8}, 1), 5);
  EXPECT_EQ(cv::countNonZero(planes.correlation({}, 0, 0, 5)), 0);
  EXPECT_TRUE(edge_pixels(cv::Mat(8, 8, CV_32FC2, cv::Scalar::all(0)), 0.25F).empty());
}

TEST(EdgeCorrelation, EnergyIsZeroOutside) {
  cv::Mat field(4, 4, CV_32FC2, cv::Scalar(3, 4));
  const FieldPlanes planes(field, 6);
  EXPECT_EQ(planes.energy(3, 0), 25);
  EXPECT_EQ(planes.energy(4, 0), 0);
  EXPECT_EQ(planes.energy(-1, 2), 0);
  EXPECT_EQ(planes.energy(-100, 2), 0);
  EXPECT_EQ(planes.energy(2, 100), 0);
}

}  // namespace
}  // namespace orbitfuse
