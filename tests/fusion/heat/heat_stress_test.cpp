// SPDX-License-Identifier: BSD-3-Clause
// Heat on images that leave quantiles and ratios undefined.
#include <gtest/gtest.h>

#include <limits>

#include "core/system/parallel.hpp"
#include "tests/fusion/fuse/images.hpp"
#include "tests/fusion/heat/by_heat.hpp"

namespace orbitfuse {
namespace {
using namespace testing;

constexpr float infinite = std::numeric_limits<float>::infinity(),
                largest = std::numeric_limits<float>::max();

TEST(HeatStress, AwkwardPairsGiveAPicture) {
  const cv::Size size(64, 48);
  for (const NamedImage& v : awkward_images(size))
    for (const NamedImage& t : awkward_images(size)) {
      const auto shown = fuse(v.image, t.image, {}, by_heat());
      ASSERT_TRUE(shown) << v.name << " with " << t.name;
      EXPECT_EQ(shown->size(), size);
      EXPECT_EQ(shown->type(), CV_8UC3);
      const bool flat = t.name == "black" || t.name == "white" || t.name == "constant";
      std::vector<cv::Mat> channels;
      cv::split(*shown, channels);
      if (flat) {
        EXPECT_EQ(cv::norm(channels[0], v.image, cv::NORM_INF), 0)
            << "nothing is unusual: " << t.name;
      }
    }
}

TEST(HeatStress, OnePixel) {
  const cv::Mat1b v(1, 1, uchar{100});
  EXPECT_EQ(fuse(v, cv::Mat1f(1, 1, 300.0F), {}, by_heat()).value().at<cv::Vec3b>(0, 0),
            cv::Vec3b::all(100));
  EXPECT_FALSE(fuse(v, cv::Mat1f(1, 1, nan), {}, by_heat()));
  EXPECT_FALSE(fuse(cv::Mat(), cv::Mat(), {}, by_heat()));
}

TEST(HeatStress, NothingValidIsAnErrorAndInfinityIsAHole) {
  const cv::Mat1b v = noise({40, 30}, 1);
  for (const float value : {nan, infinite, -infinite}) {
    const auto nothing = fuse(v, cv::Mat1f(v.size(), value), {}, by_heat());
    ASSERT_FALSE(nothing);
    EXPECT_EQ(nothing.error().where, "thermal");
  }
  EXPECT_EQ(
      fuse(v, cv::Mat1f(v.size(), 300.0F), cv::Mat1b::zeros(v.size()), by_heat()).error().where,
      "mask");
  cv::Mat1f kelvin(v.size(), 300.0F);
  kelvin(3, 4) = infinite;
  kelvin(20, 20) = nan;
  EXPECT_TRUE(fuse(v, kelvin, {}, by_heat()));
  fusion::HeatOptions plain;
  plain.hatching = 0;
  const cv::Mat3f bgr(30, 40, cv::Vec3f(10, 20, 30));
  EXPECT_EQ(cv::norm(fusion::colored_by_heat(bgr, cv::Mat1f(bgr.size(), nan), {}, plain).value(),
                     bgr, cv::NORM_INF),
            0)
      << "nothing measured: the visible picture";
}

TEST(HeatStress, ExtremeScalesStayFinite) {
  const cv::Mat1b v = noise({40, 30}, 1);
  for (const auto& [usual, hot] : {std::pair{-largest, largest},
                                   {0.0F, largest},
                                   {1e30F, 1.0001e30F},
                                   {0.0F, 1e-38F},
                                   {-1e-30F, 1e-30F},
                                   {300.0F, 300.0001F}}) {
    cv::Mat1f thermal(v.size(), usual);
    thermal(cv::Rect(5, 5, 8, 8)) = hot;
    const auto shown = fuse(v, thermal, {}, by_heat());
    ASSERT_TRUE(shown) << usual << " to " << hot << ": " << shown.error().message();
    std::vector<cv::Mat> channels;
    cv::split(*shown, channels);
    EXPECT_EQ(cv::norm(channels[0].colRange(20, 40), v.colRange(20, 40), cv::NORM_INF), 0)
        << usual << " to " << hot;
  }
}

TEST(HeatStress, ThreadsDoNotChangeABit) {
  const cv::Mat1b v = noise({160, 120}, 1), t = noise({160, 120}, 2);
  set_thread_count(1);
  const cv::Mat one = fuse(v, t, {}, by_heat()).value();
  set_thread_count(4);
  const cv::Mat four = fuse(v, t, {}, by_heat()).value();
  set_thread_count(0);
  EXPECT_EQ(cv::norm(one, four, cv::NORM_INF), 0);
}

}  // namespace
}  // namespace orbitfuse
