// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/palette.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orbitfuse {
namespace {

double brightness(const cv::Vec3b& c) { return 0.114 * c[0] + 0.587 * c[1] + 0.299 * c[2]; }

TEST(Palette, AllHave256DistinctlyOrderedColours) {
  for (const std::string& name : palette_names()) {
    const auto colors = palette(name);
    ASSERT_TRUE(colors) << name;
    EXPECT_EQ(colors->size(), cv::Size(256, 1));
    EXPECT_EQ(colors->type(), CV_8UC3);
  }
  for (const char* name : {"inferno", "ironbow", "white-hot"}) {
    const cv::Mat c = *palette(name);
    for (int i = 8; i < 256; i += 8) {
      EXPECT_GT(brightness(c.at<cv::Vec3b>(0, i)), brightness(c.at<cv::Vec3b>(0, i - 8)))
          << name << " " << i;
    }
  }
}

TEST(Palette, RainbowIsBlueWhereColdAndRedWhereHot) {
  const cv::Mat c = *palette("rainbow");
  EXPECT_GT(c.at<cv::Vec3b>(0, 0)[0], c.at<cv::Vec3b>(0, 0)[2]);
  EXPECT_GT(c.at<cv::Vec3b>(0, 255)[2], c.at<cv::Vec3b>(0, 255)[0]);
}

TEST(Palette, UnknownNameListsTheKnownOnes) {
  const auto p = palette("purple");
  ASSERT_FALSE(p);
  EXPECT_EQ(p.error().kind, ErrorKind::usage);
  EXPECT_NE(p.error().message().find("ironbow"), std::string::npos);
}

TEST(Palette, ColorizeClampsAndBlackensNan) {
  cv::Mat kelvin = (cv::Mat_<float>(1, 5) << 280.F, 290.F, 400.F, 100.F,
                    std::numeric_limits<float>::quiet_NaN());
  const cv::Mat white = *palette("white-hot");
  const cv::Mat image = colorize(kelvin, {280, 300}, white);
  EXPECT_EQ(image.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 0));
  EXPECT_NEAR(image.at<cv::Vec3b>(0, 1)[0], 128, 1);
  EXPECT_EQ(image.at<cv::Vec3b>(0, 2), cv::Vec3b(255, 255, 255));
  EXPECT_EQ(image.at<cv::Vec3b>(0, 3), cv::Vec3b(0, 0, 0));
  EXPECT_EQ(image.at<cv::Vec3b>(0, 4), cv::Vec3b(0, 0, 0));
  EXPECT_NO_FATAL_FAILURE(colorize(kelvin, {300, 300}, white));
}

TEST(Palette, CommonSpanIgnoresOutliersNanAndIsNeverEmpty) {
  cv::Mat a(100, 100, CV_32FC1), b(10, 10, CV_32FC1, cv::Scalar(295));
  for (int i = 0; i < 10000; ++i)
    a.at<float>(i / 100, i % 100) = static_cast<float>(290 + 0.001 * i);
  a.at<float>(0, 0) = 5000;
  a.at<float>(0, 1) = std::numeric_limits<float>::quiet_NaN();
  a.at<float>(0, 2) = std::numeric_limits<float>::infinity();
  const TemperatureSpan span = common_span({a, b});
  EXPECT_NEAR(span.low_k, 290.05, 0.01);
  EXPECT_NEAR(span.high_k, 299.95, 0.01);
  const TemperatureSpan flat = common_span({b});
  EXPECT_NEAR(flat.high_k - flat.low_k, 0.5, 1e-9);
  EXPECT_NEAR(0.5 * (flat.high_k + flat.low_k), 295, 1e-6);
  const TemperatureSpan none = common_span({});
  EXPECT_TRUE(std::isfinite(none.low_k) && none.high_k > none.low_k);
}

}  // namespace
}  // namespace orbitfuse
