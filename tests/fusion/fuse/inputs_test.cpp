// SPDX-License-Identifier: BSD-3-Clause
// What fuse takes beside 8-bit pairs, what it gives beside gray, and what it leaves out.
#include <gtest/gtest.h>

#include <limits>
#include <opencv2/imgproc.hpp>

#include "fusion/fuse/fuse.hpp"
#include "fusion/fuse/holes.hpp"
#include "tests/fusion/fuse/images.hpp"

namespace orbitfuse {
namespace {
using namespace testing;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

cv::Mat1f kelvin_of(const cv::Mat1b& gray) {
  cv::Mat1f kelvin;
  gray.convertTo(kelvin, CV_32F, 0.1, 280);
  return kelvin;
}

double difference(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF); }

TEST(FusionKelvin, LockedSpanIsTheGrayImage) {
  const cv::Mat1b v = noise({48, 40}, 1), t = noise({48, 40}, 2);
  FusionOptions options;
  options.span = TemperatureSpan{280, 305.5};
  EXPECT_LE(difference(fuse(v, kelvin_of(t), {}, options).value(), fuse(v, t, {}, {}).value()), 1);
}

TEST(FusionKelvin, OwnSpanDoesNotDependOnTheUnit) {
  const cv::Mat1b v = noise({48, 40}, 1);
  const cv::Mat1f kelvin = kelvin_of(noise({48, 40}, 2)), celsius = kelvin - 273.15F;
  EXPECT_LE(difference(fuse(v, kelvin, {}, {}).value(), fuse(v, celsius, {}, {}).value()), 1);
}

TEST(FusionKelvin, NotANumberIsAHole) {
  const cv::Mat1b v = noise({64, 64}, 1), t = noise({64, 64}, 2);
  FusionOptions options;
  options.span = TemperatureSpan{280, 305.5};
  cv::Mat1f kelvin = kelvin_of(t);
  cv::Mat1b mask(t.size(), uchar{255});
  const cv::Rect hole(20, 20, 9, 14);
  mask(hole) = 0;
  kelvin(hole) = nan;
  kelvin(25, 22) = std::numeric_limits<float>::infinity();
  const cv::Mat fused = fuse(v, kelvin, {}, options).value();
  EXPECT_EQ(difference(fused, fuse(v, kelvin_of(t), mask, options).value()), 0);
  EXPECT_EQ(difference(fused(hole), v(hole)), 0);
  cv::Mat1b other(t.size(), uchar{255});
  other.row(3) = 0;
  EXPECT_EQ(difference(fuse(v, kelvin, other, options).value().row(3), v.row(3)), 0)
      << "both masks hold";
}

TEST(FusionKelvin, NothingFiniteAndFallingSpansAreErrors) {
  const cv::Mat1b v = noise({32, 32}, 1);
  const auto empty = fuse(v, cv::Mat1f(32, 32, nan), {}, {});
  ASSERT_FALSE(empty);
  EXPECT_EQ(empty.error().where, "thermal");
  for (const TemperatureSpan span :
       {TemperatureSpan{300, 280}, {280, 280}, {280, std::numeric_limits<double>::infinity()}}) {
    FusionOptions options;
    options.span = span;
    const auto bad = fuse(v, kelvin_of(v), {}, options);
    ASSERT_FALSE(bad);
    EXPECT_EQ(bad.error().kind, ErrorKind::usage);
    EXPECT_EQ(bad.error().where, "span");
  }
  EXPECT_TRUE(fuse(v, cv::Mat1f(32, 32, 295.0F), {}, {})) << "one temperature everywhere";
}

TEST(FusionOverlay, HueTellsTheTemperatureBrightnessTheDetail) {
  const cv::Mat1b t = ramp({64, 48});
  cv::Mat v;
  cv::merge(std::vector<cv::Mat>(3, noise({64, 48}, 1) / 4 + 90), v);
  FusionOptions options;
  options.overlay.palette = "rainbow";
  const cv::Mat shown = fuse(v, t, {}, options).value();
  ASSERT_EQ(shown.type(), CV_8UC3);
  const cv::Scalar cold = cv::mean(shown.colRange(0, 12)), hot = cv::mean(shown.colRange(48, 60));
  EXPECT_GT(cold[0] - cold[2], 20) << "blue";
  EXPECT_GT(hot[2] - hot[0], 20) << "red";
  options.color = false;
  EXPECT_EQ(fuse(v, t, {}, options).value().type(), CV_8UC3);
  options.overlay.strength = 0;
  options.color = true;
  options.overlay.palette = "inferno";
  const cv::Mat none = fuse(v, t, {}, options).value();
  options.overlay.palette.clear();
  EXPECT_EQ(difference(none, fuse(v, t, {}, options).value()), 0);
}

TEST(FusionOverlay, HolesKeepTheVisibleColour) {
  const cv::Mat v(48, 48, CV_8UC3, cv::Scalar(20, 90, 160));
  cv::Mat1b mask(48, 48, uchar{255});
  mask(cv::Rect(10, 10, 20, 20)) = 0;
  FusionOptions options;
  options.overlay.palette = "ironbow";
  const cv::Mat shown = fuse(v, ramp({48, 48}), mask, options).value();
  EXPECT_LE(difference(shown(cv::Rect(10, 10, 20, 20)), v(cv::Rect(10, 10, 20, 20))), 1);
}

TEST(FusionOverlay, MistakesAreNamed) {
  FusionOptions options;
  options.overlay.palette = "plaid";
  EXPECT_EQ(options.validate().error().where, "palette");
  options.overlay = {"inferno", 1.5};
  EXPECT_EQ(options.validate().error().where, "overlay.strength");
}

TEST(FusionSkips, PixelsFarFromThermalOnes) {
  const cv::Mat1b v = noise({480, 320}, 1), t = noise({480, 320}, 2);
  cv::Mat1b mask = cv::Mat1b::zeros(v.size());
  const cv::Rect seen(200, 150, 60, 50);
  mask(seen) = 255;
  for (const std::string& method : fusion_method_names()) {
    if (method == "heat") continue;  // has no work to spare
    FusionOptions options;
    options.method = fusion_method(method).value();
    FusionReport report;
    const cv::Mat part = fuse(v, t, mask, options, &report).value();
    EXPECT_GT(report.skipped.pixels, 0.5) << method;
    ASSERT_FALSE(report.skips.empty());
    EXPECT_EQ(report.skips[0].what, "pixels far from any thermal one");
    options.skip_unneeded = false;
    const cv::Mat whole = fuse(v, t, mask, options, &report).value();
    EXPECT_EQ(report.skipped.pixels, 0) << method;
    EXPECT_EQ(difference(part(cv::Rect(0, 0, 480, 150)), v(cv::Rect(0, 0, 480, 150))), 0);
    // PCA-MSIF's weights are of the whole image, so they may differ.
    if (method != "pca-msif") {
      EXPECT_LT(cv::norm(part(seen), whole(seen), cv::NORM_L1) / seen.area(), 3) << method;
    }
  }
}

TEST(FusionSkips, NeededPartIsOnTheGridAndLargeEnough) {
  cv::Mat1b mask = cv::Mat1b::zeros(301, 517);
  mask(150, 200) = 255;
  const cv::Rect part = needed_part(mask);
  EXPECT_EQ(part.x % 64, 0);
  EXPECT_EQ(part.y % 64, 0);
  EXPECT_GE(part.width, 128);
  EXPECT_TRUE(part.contains({200, 150}));
  mask = cv::Mat1b::zeros(301, 517);
  mask(300, 516) = 255;
  EXPECT_GE(needed_part(mask).width, 16);
  EXPECT_EQ(needed_part(cv::Mat1b(40, 40, uchar{255})), cv::Rect(0, 0, 40, 40));
}

TEST(FusionSkips, LevelsThatHoldNothing) {
  // Bicubic enlargement leaves nothing in the finest band.
  cv::Mat small_v, small_t, v, t;
  cv::GaussianBlur(noise({40, 30}, 1), small_v, {9, 9}, 3);
  cv::GaussianBlur(noise({40, 30}, 2), small_t, {9, 9}, 3);
  cv::resize(small_v, v, {640, 480}, 0, 0, cv::INTER_CUBIC);
  cv::resize(small_t, t, {640, 480}, 0, 0, cv::INTER_CUBIC);
  cv::GaussianBlur(v, v, {0, 0}, 6);
  cv::GaussianBlur(t, t, {0, 0}, 6);
  cv::Mat1f fv, ft;
  v.convertTo(fv, CV_32F);
  t.convertTo(ft, CV_32F);
  cv::GaussianBlur(fv, fv, {0, 0}, 6);
  cv::GaussianBlur(ft, ft, {0, 0}, 6);
  fusion::BestReport best;
  ASSERT_TRUE(fusion::fuse_best(fv, ft, {}, &best));
  EXPECT_GE(best.levels_skipped, 0.25);
  fusion::MsSrifReport ms_srif;
  ASSERT_TRUE(fusion::fuse_ms_srif(fv, ft, {}, &ms_srif));
  EXPECT_EQ(ms_srif.levels_skipped, best.levels_skipped);
}

TEST(FusionSkips, IdenticalImagesAreSkippedWhole) {
  FusionReport report;
  const cv::Mat1b v = noise({32, 32}, 1);
  ASSERT_TRUE(fuse(v, v, {}, {}, &report));
  EXPECT_EQ(report.skipped.pixels, 1);
  EXPECT_EQ(report.skipped.levels, 1);
}

}  // namespace
}  // namespace orbitfuse
