// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/heat/heat.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <opencv2/imgproc.hpp>
#include <set>

#include "fusion/heat/legend.hpp"
#include "tests/fusion/fuse/images.hpp"
#include "tests/fusion/heat/by_heat.hpp"

namespace orbitfuse {
namespace {
using namespace testing;

/// A yard of 20 degrees with a sky of -30, a house of 30 and a bolt of 70 on it, all in kelvin.
cv::Mat1f yard(cv::Size size) {
  cv::Mat1f kelvin(size);
  cv::theRNG().state = 7;
  cv::randn(kelvin, 293.15, 0.2);
  kelvin.rowRange(0, size.height / 4).setTo(243.15F);
  kelvin(cv::Rect(size.width / 4, size.height / 3, size.width / 3, size.height / 3)) += 10;
  kelvin(cv::Rect(size.width / 3, size.height / 2, 4, 4)) += 40;
  return kelvin;
}

cv::Mat3b picture(cv::Size size, std::uint64_t seed = 3) {
  cv::Mat3b image(size);
  cv::RNG random(seed);
  random.fill(image, cv::RNG::UNIFORM, 60, 200);
  return image;
}

TEST(HeatScale, TheSurroundingsAreUsualAndTheBoltIsHot) {
  const HeatScale scale = heat_scale({yard({320, 240})});
  EXPECT_NEAR(scale.usual, 293.15, 0.2);
  EXPECT_NEAR(scale.spread, 0.2, 0.2) << "neither the sky nor the house";
  EXPECT_NEAR(scale.hot, 343.15, 1);
}

TEST(HeatScale, OneForAllViewsAndHolesDontCount) {
  const cv::Mat1f cold(40, 40, 280.0F), empty(40, 40, nan);
  cv::Mat1f warm(40, 40, 280.0F);
  warm(cv::Rect(10, 10, 10, 10)) = 300;
  const HeatScale scale = heat_scale({cold, empty, warm});
  EXPECT_NEAR(scale.usual, 280, 1e-3);
  EXPECT_NEAR(scale.hot, 300, 1e-3);
}

TEST(HeatScale, StrengthRisesFromUsualToHot) {
  const HeatScale scale{290, 0.5, 330};
  EXPECT_EQ(scale.strength(250), 0);
  EXPECT_EQ(scale.strength(290), 0);
  double before = 0;
  for (double t = 290.1; t <= 330; t += 0.1) {
    EXPECT_GT(scale.strength(t), before) << t;
    before = scale.strength(t);
  }
  EXPECT_NEAR(scale.strength(330), 1, 1e-6);
  EXPECT_EQ(scale.strength(400), scale.strength(1e9)) << "no further than its end";
  EXPECT_LT(scale.strength(290.1), 0.01) << "scatter of the surroundings";
}

TEST(Heat, WhatIsUsualOrColdStaysTheVisiblePicture) {
  const cv::Mat3b v = picture({160, 120});
  cv::Mat1f kelvin(v.size(), 290.0F);
  kelvin(cv::Rect(0, 0, 60, 40)) = 250;
  const cv::Rect hot(90, 60, 20, 20);
  kelvin(hot) = 320;
  cv::Mat3b shown = fuse(v, kelvin, {}, by_heat()).value();
  EXPECT_GT(cv::norm(shown(hot), v(hot), cv::NORM_L1) / hot.area(), 60);
  v(hot).copyTo(shown(hot));
  EXPECT_EQ(cv::norm(shown, v, cv::NORM_INF), 0)
      << "no halo: not one pixel beside the hot square changes";
}

TEST(Heat, TheDetailOfTheVisiblePictureShowsThrough) {
  const cv::Mat1b board = checkerboard({64, 64});
  cv::Mat1f kelvin(board.size(), 290.0F);
  kelvin.rowRange(40, 64).setTo(320);
  const cv::Mat shown = fuse(board, kelvin, {}, by_heat()).value();
  ASSERT_EQ(shown.type(), CV_8UC3);
  const cv::Vec3b a = shown.at<cv::Vec3b>(50, 10), b = shown.at<cv::Vec3b>(50, 11);
  EXPECT_GT(cv::norm(cv::Vec3i(a) - cv::Vec3i(b)), 30);
}

TEST(Heat, EqualTemperaturesLookAlikeInAllViewsOfAScene) {
  const cv::Mat3b v = picture({96, 96});
  cv::Mat1f first = yard(v.size()), second(v.size(), 300.0F);
  first(cv::Rect(5, 60, 10, 10)) = 300;
  FusionOptions options = by_heat();
  options.heat.scale = heat_scale({first, second});
  const cv::Rect same(5, 60, 10, 10);
  EXPECT_EQ(cv::norm(fuse(v, first, {}, options).value()(same),
                     fuse(v, second, {}, options).value()(same), cv::NORM_INF),
            0);
}

TEST(Heat, GrayLevelsWithoutTemperaturesWork) {
  const cv::Mat3b v = picture({128, 96});
  cv::Mat1b gray(v.size(), uchar{70});
  const cv::Rect person(60, 30, 12, 30);
  gray(person) = 180;
  const cv::Mat3b shown = fuse(v, gray, {}, by_heat()).value();
  EXPECT_GT(cv::norm(shown(person), v(person), cv::NORM_L1) / person.area(), 60);
  EXPECT_EQ(cv::norm(shown.colRange(0, 50), v.colRange(0, 50), cv::NORM_INF), 0);
  cv::Mat1b noisy = gray.clone();
  noisy(person) = 70;
  for (int y = 0; y < noisy.rows; ++y)
    for (int x = 0; x < noisy.cols; ++x)
      noisy(y, x) = static_cast<uchar>(70 + (x * 7 + y * 13) % 3);
  EXPECT_LT(cv::norm(fuse(v, noisy, {}, by_heat()).value(), v, cv::NORM_L1) /
                (3.0 * static_cast<double>(v.total())),
            16)
      << "noise of an 8-bit image stays faint";
}

TEST(Heat, HolesFadeAndAreHatched) {
  const cv::Mat3b v(120, 160, cv::Vec3b(90, 90, 90));
  cv::Mat1f kelvin(v.size(), 320.0F);
  kelvin.colRange(0, 20).setTo(290);
  kelvin.rowRange(0, 50).setTo(nan);
  FusionOptions options = by_heat();
  options.heat.scale = HeatScale{290, 0, 320};
  FusionReport report;
  const cv::Mat3b shown = fuse(v, kelvin, {}, options, &report).value();
  EXPECT_NEAR(report.unmeasured, 50.0 / 120, 1e-6);
  const auto change = [&](int row) {
    return cv::norm(shown.row(row), v.row(row), cv::NORM_L1) / v.cols;
  };
  EXPECT_LT(change(50), 0.5 * change(60)) << "faint at the edge";
  EXPECT_GT(change(110), 100);
  EXPECT_GT(cv::norm(shown.row(10), v.row(10), cv::NORM_INF), 10) << "hatching";
  EXPECT_LT(change(10), 30) << "and no colour";
  options.heat.hatching = 0;
  const cv::Mat3b plain = fuse(v, kelvin, {}, options).value();
  EXPECT_EQ(cv::norm(plain.row(10), v.row(10), cv::NORM_INF), 0);
}

TEST(Heat, GrayLevelsEndWhereSamplesDo) {
  const HeatScaleOptions gray = HeatScaleOptions::of_gray_levels();
  EXPECT_EQ(within_levels({89, 23, 263}, gray).hot, 255);
  EXPECT_EQ(within_levels({89, 23, 263}, gray).usual, 89);
  const HeatScale bright = heat_scale({cv::Mat(4, 4, CV_32FC1, cv::Scalar(252))}, gray);
  EXPECT_EQ(bright.usual, 252);
  EXPECT_EQ(bright.hot, 268) << "or noise would be coloured";
  EXPECT_EQ(within_levels({290, 1, 400}, {}).hot, 400);
}

TEST(Heat, WhatWasNotMeasuredIsGrayStripesOnAPalette) {
  cv::Mat levels(20, 20, CV_32FC1, cv::Scalar(300));
  levels.rowRange(0, 10).setTo(std::numeric_limits<float>::quiet_NaN());
  cv::Mat3b painted(20, 20, cv::Vec3b(1, 2, 3));
  fusion::hatch_unmeasured(painted, levels);
  std::set<int> grays;
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 20; ++x) {
      const cv::Vec3b& p = painted(y, x);
      EXPECT_TRUE(p[0] == p[1] && p[1] == p[2]);
      grays.insert(p[0]);
    }
  EXPECT_EQ(grays.size(), 2u);
  EXPECT_EQ(painted(15, 5), cv::Vec3b(1, 2, 3));
}

TEST(Heat, LegendKeepsItsWordsOffTheEdges) {
  const fusion::HeatLegend legend{{292, 0.5, 335}, fusion::HeatUnit::kelvin, {}};
  for (const int width : {640, 1280}) {
    const cv::Mat strip = fusion::heat_legend(legend, width).value();
    for (const int x : {0, width - width / 80})
      EXPECT_EQ(
          cv::norm(strip.colRange(x, x + width / 80),
                   cv::Mat(strip.rows, width / 80, CV_8UC3, cv::Scalar::all(255)), cv::NORM_INF),
          0);
  }
}

/// Cut off it would say something else.
TEST(Heat, ANarrowLegendHasNoSentence) {
  const fusion::HeatLegend legend{{292, 0.5, 335}, fusion::HeatUnit::kelvin, {}};
  const cv::Mat narrow = fusion::heat_legend(legend, 160).value();
  EXPECT_EQ(cv::norm(narrow.col(159), cv::Mat(narrow.rows, 1, CV_8UC3, cv::Scalar::all(255)),
                     cv::NORM_INF),
            0);
  EXPECT_LT(narrow.rows + 4, fusion::heat_legend(legend, 300).value().rows) << "a row of text less";
}

TEST(Heat, LegendHasThePicturesWidthAndItsColours) {
  fusion::HeatLegend legend{{290, 0.5, 330}, fusion::HeatUnit::kelvin, {}};
  for (const int width : {1, 16, 320, 1280}) {
    const cv::Mat strip = fusion::heat_legend(legend, width).value();
    EXPECT_EQ(strip.cols, width);
    EXPECT_EQ(strip.type(), CV_8UC3);
  }
  const cv::Mat3b v = picture({320, 40});
  const cv::Mat joined = fusion::with_heat_legend(v, legend).value();
  EXPECT_EQ(joined.cols, 320);
  EXPECT_GT(joined.rows, 40);
  EXPECT_EQ(cv::norm(joined.rowRange(0, 40), v, cv::NORM_INF), 0);
  legend.how.palette = "plaid";
  EXPECT_EQ(fusion::heat_legend(legend, 320).error().where, "palette");
}

TEST(Heat, MistakesAreNamed) {
  FusionOptions options = by_heat();
  options.heat.opacity = 1.5;
  EXPECT_EQ(options.validate().error().where, "heat.opacity");
  options.heat = {};
  options.heat.scale = HeatScale{300, 0, 290};
  EXPECT_EQ(options.validate().error().where, "heat.scale");
  options.heat = {};
  const auto sizes = fuse(picture({32, 32}), cv::Mat1f(32, 31, 290.0F), {}, options);
  ASSERT_FALSE(sizes);
  EXPECT_EQ(sizes.error().where, "thermal");
}

}  // namespace
}  // namespace orbitfuse
