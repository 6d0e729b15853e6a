// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/gray_curves.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int gray_views = 12;

/// The toy scene in gray levels, each view made by a curve of its own: `curve` of a value 0..1.
template <class Curve>
Dataset gray_scene(const Curve& curve) {
  Dataset data = test::toy_scene(Modality::thermal, gray_views, 1, 96);
  data.thermal_is_gray = true;
  double low = 1e9, high = -1e9;
  for (const TrainingView& view : data.views) {
    double least = 0, most = 0;
    cv::minMaxLoc(view.image, &least, &most);
    low = std::min(low, least), high = std::max(high, most);
  }
  for (std::size_t i = 0; i < data.views.size(); ++i)
    for (float& v : cv::Mat_<float>(data.views[i].image))
      v = static_cast<float>(
          std::round(10 + 235 * std::clamp(curve(i, (v - low) / (high - low)), 0.0, 1.0)));
  return data;
}

/// Gains of .6 to 1 and levels that differ by up to a quarter of the range.
double gain_and_level(std::size_t view, double value) {
  const double phase = static_cast<double>(view);
  return (0.8 + 0.2 * std::sin(2.1 * phase)) * value + 0.12 * (1 + std::cos(1.3 * phase)) * 0.5;
}

double bent(std::size_t view, double value) {
  return std::pow(value, std::exp(0.5 * std::sin(2.1 * static_cast<double>(view))));
}

GrayCurves curves_of(const Dataset& data, std::vector<bool> heldout = {}) {
  heldout.resize(data.views.size(), false);
  return estimate_gray_curves(data, test::toy_depth(data), heldout);
}

/// Median distance of samples from their points' mean levels, as a share of how far levels vary.
double disagreement(Dataset data, const GrayCurves* curves) {
  if (curves != nullptr)
    for (std::size_t i = 0; i < data.views.size(); ++i)
      data.views[i].image = to_common_levels(data.views[i].image, curves->of_view[i]);
  double variance = 0;
  for (const TrainingView& view : data.views) {
    cv::Scalar mean, deviation;
    cv::meanStdDev(view.image, mean, deviation);
    variance += deviation[0] * deviation[0] / static_cast<double>(data.views.size());
  }
  return curves_of(data).before / std::sqrt(variance);
}

TEST(GrayCurves, BringViewsOfOtherGainsToOneScale) {
  const Dataset data = gray_scene(gain_and_level);
  const GrayCurves found = curves_of(data);
  ASSERT_TRUE(found.told()) << found.spread << " " << found.left << " " << found.before;
  EXPECT_LT(disagreement(data, &found), 0.35 * disagreement(data, nullptr));
}

TEST(GrayCurves, BringBentCurvesToOneScale) {
  const Dataset data = gray_scene(bent);
  const GrayCurves found = curves_of(data);
  ASSERT_TRUE(found.told()) << found.spread << " " << found.left << " " << found.before;
  EXPECT_LT(disagreement(data, &found), 0.5 * disagreement(data, nullptr));
}

TEST(GrayCurves, RiseAndFillTheRangeWithWhatThePicturesShow) {
  // The last view's picture holds few levels, and steeply: its curve goes on beyond what any has.
  const Dataset data = gray_scene([](std::size_t view, double value) {
    return view + 1 == gray_views ? 0.4 + 0.2 * value : bent(view, value);
  });
  const GrayCurves found = curves_of(data);
  ASSERT_EQ(found.of_view.size(), static_cast<std::size_t>(gray_views));
  double low = 255, high = 0;
  for (std::size_t i = 0; i < found.of_view.size(); ++i) {
    EXPECT_TRUE(std::is_sorted(found.of_view[i].begin(), found.of_view[i].end()));
    double least = 0, most = 0;
    cv::minMaxLoc(to_common_levels(data.views[i].image, found.of_view[i]), &least, &most);
    EXPECT_TRUE(least >= 0 && most <= 255) << least << " " << most;
    low = std::min(low, least), high = std::max(high, most);
  }
  EXPECT_LT(low, 1);
  EXPECT_GT(high, 254);
}

TEST(GrayCurves, BlackHotViewsAmongWhiteHotAreTurned) {
  const auto mixed = [](std::size_t view, double value) {
    const double level = gain_and_level(view, value);
    return view % 3 == 1 ? 1 - level : level;
  };
  const Dataset data = gray_scene(mixed), white = gray_scene(gain_and_level);
  for (const std::size_t heldout : {std::size_t{5}, std::size_t{7}}) {  // one of either kind
    std::vector<bool> apart(data.views.size(), false);
    apart[heldout] = true;
    const GrayCurves found = curves_of(data, apart);
    ASSERT_TRUE(found.told());
    EXPECT_EQ(found.reversed, (std::vector<std::size_t>{1, 4, 7, 10}));
    EXPECT_LT(disagreement(data, &found), 0.35 * disagreement(white, nullptr));
  }
  EXPECT_TRUE(curves_of(white).reversed.empty());
}

/// A camera whose levels drift by more than the scene has: which views see a place then says more
/// of its mean level than how warm it is.
TEST(GrayCurves, ViewsOfADriftingCameraAreNotTurned) {
  const Dataset data = gray_scene([](std::size_t view, double value) {
    return 0.15 * value + 0.8 * static_cast<double>((5 * view) % gray_views) / gray_views;
  });
  EXPECT_TRUE(curves_of(data).reversed.empty());
}

/// Levels that lie apart and have nothing in common: flat curves bring them together.
TEST(GrayCurves, CurvesThatTellNothingApartAreNotTaken) {
  Dataset data = test::toy_scene(Modality::thermal, gray_views, 1, 288);
  data.thermal_is_gray = true;
  cv::RNG rng(5);
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    cv::Mat1f patches(6, 8);
    const double low = 20 + 16.0 * static_cast<double>((5 * i) % gray_views);
    rng.fill(patches, cv::RNG::UNIFORM, low, low + 30);
    cv::resize(patches, data.views[i].image, data.views[i].image.size(), 0, 0, cv::INTER_LINEAR);
  }
  const GrayCurves found = curves_of(data);
  EXPECT_TRUE(found.flattened()) << found.slope;
  EXPECT_FALSE(found.told());
  EXPECT_LT(found.agreement, 0.3);
  for (const auto curve : {gain_and_level, bent})
    EXPECT_GT(curves_of(gray_scene(curve)).slope, 0.8);
  // The sun in every other picture: the rest of it has a sixth of the levels.
  const GrayCurves narrow = curves_of(
      gray_scene([](std::size_t view, double v) { return view % 2 == 0 ? v : 0.1 + v / 6; }));
  EXPECT_TRUE(narrow.told()) << narrow.slope << " " << narrow.agreement;
}

TEST(GrayCurves, AViewThatSharesNothingIsNamed) {
  Dataset data = gray_scene(gain_and_level);
  data.views[4].image = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(curves_of(data).alone, std::vector<std::size_t>{4});
}

TEST(GrayCurves, LevelsThatNoCurveBringsTogetherAreSaidSo) {
  Dataset data = gray_scene(gain_and_level);
  EXPECT_FALSE(curves_of(data).contradict());
  cv::RNG rng(5);  // each view's even patches have levels of their own
  for (TrainingView& view : data.views) {
    cv::Mat1f patches(6, 8);
    rng.fill(patches, cv::RNG::UNIFORM, 20, 235);
    cv::resize(patches, view.image, view.image.size(), 0, 0, cv::INTER_NEAREST);
  }
  const GrayCurves found = curves_of(data);
  EXPECT_TRUE(found.contradict()) << found.points << " " << found.left << " " << found.variety;
}

TEST(GrayCurves, OfOneSpanAreLeftAlone) {
  const GrayCurves found = curves_of(gray_scene([](std::size_t, double v) { return v; }));
  EXPECT_FALSE(found.told()) << found.spread;
}

TEST(GrayCurves, HeldOutViewsFollowAndHaveNoSay) {
  const Dataset data = gray_scene(gain_and_level);
  std::vector<bool> heldout(data.views.size(), false);
  heldout[3] = heldout[8] = true;
  const GrayCurves found = curves_of(data, heldout);
  Dataset spoilt = data;  // few levels: the steepest of all curves
  spoilt.views[3].image = cv::Mat(120 + 0.05 * data.views[3].image);
  const GrayCurves other = curves_of(spoilt, heldout);
  ASSERT_TRUE(found.told() && other.told());
  for (std::size_t i = 0; i < data.views.size(); ++i)
    EXPECT_TRUE(heldout[i] || found.of_view[i] == other.of_view[i]) << i;
  EXPECT_LT(disagreement(data, &found), 0.45 * disagreement(data, nullptr));
}

TEST(GrayCurves, AHeldOutBlackHotViewMakesNoOthersMove) {
  const Dataset data = gray_scene([](std::size_t view, double v) { return view == 3 ? 1 - v : v; });
  std::vector<bool> heldout(data.views.size(), false);
  heldout[3] = true;
  const GrayCurves found = curves_of(data, heldout);
  EXPECT_FALSE(found.told());
  EXPECT_EQ(found.reversed, std::vector<std::size_t>{3});
  heldout[3] = false;
  EXPECT_TRUE(curves_of(data, heldout).told());
}

TEST(GrayCurves, NothingSharedIsNotTold) {
  Dataset data = gray_scene(gain_and_level);
  const std::vector<bool> none(data.views.size(), false);
  EXPECT_FALSE(estimate_gray_curves(data, {}, none).told());
  EXPECT_FALSE(GrayCurves{}.told());
  for (TrainingView& view : data.views) view.image = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(curves_of(data).told());
  for (TrainingView& view : data.views) view.image = 90.0;
  EXPECT_FALSE(curves_of(data).told());
}

TEST(GrayCurves, UnknownPixelsStayUnknown) {
  GrayCurve curve;
  for (std::size_t k = 0; k < curve.size(); ++k) curve[k] = 20 + 24 * static_cast<double>(k);
  cv::Mat1f image(1, 3);
  image << 0, 255, std::numeric_limits<float>::quiet_NaN();
  const cv::Mat1f common = to_common_levels(image, curve);
  EXPECT_FLOAT_EQ(common(0), 20);
  EXPECT_FLOAT_EQ(common(1), 212);
  EXPECT_TRUE(std::isnan(common(2)));
}

}  // namespace
}  // namespace orbitfuse::nerf
