// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/gray_curves.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

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

/// Median difference of two views' levels at the points of the first view's map that both show.
double disagreement(const Dataset& data, const GrayCurves* curves) {
  const auto depth = test::toy_depth(data);
  std::vector<double> apart;
  Dataset common = data;
  if (curves != nullptr)
    for (std::size_t i = 0; i < data.views.size(); ++i)
      common.views[i].image = to_common_levels(data.views[i].image, curves->of_view[i]);
  const GrayCurves again =
      estimate_gray_curves(common, depth, std::vector<bool>(data.views.size(), false));
  return again.before;
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

TEST(GrayCurves, RiseAndStayInRange) {
  const GrayCurves found = curves_of(gray_scene(bent));
  ASSERT_EQ(found.of_view.size(), static_cast<std::size_t>(gray_views));
  for (const GrayCurve& curve : found.of_view) {
    EXPECT_GE(curve.front(), -1e-6);
    EXPECT_LE(curve.back(), 255 + 1e-6);
    EXPECT_TRUE(std::is_sorted(curve.begin(), curve.end()));
  }
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
  Dataset spoilt = data;
  spoilt.views[3].image = 128.0;
  const GrayCurves other = curves_of(spoilt, heldout);
  ASSERT_TRUE(found.told() && other.told());
  for (std::size_t i = 0; i < data.views.size(); ++i)
    EXPECT_TRUE(heldout[i] || found.of_view[i] == other.of_view[i]) << i;
  EXPECT_LT(disagreement(data, &found), 0.45 * disagreement(data, nullptr));
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
