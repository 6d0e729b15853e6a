// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "fusion/best/halo_rule.hpp"
#include "fusion/best/plain_regions.hpp"
#include "fusion/best/settle_levels.hpp"
#include "fusion/best/small_things.hpp"
#include "fusion/metrics/metrics.hpp"
#include "tests/support/hot_scenes.hpp"

namespace orbitfuse::fusion {
namespace {

double halo_of(const test::HotScene& scene, const HaloRule& rule) {
  const Plane fused =
      fuse_best(Plane(scene.visible), Plane(scene.thermal), {}, rule, nullptr).value();
  cv::Mat v, t, f;
  scene.visible.convertTo(v, CV_8U);
  scene.thermal.convertTo(t, CV_8U);
  fused.convertTo(f, CV_8U);
  const auto values = fusion_metrics(v, t, f).value();
  for (const MetricValue& m : values)
    if (m.name == "halo") return m.value;
  ADD_FAILURE() << "no halo";
  return -1;
}

TEST(BestHalo, NoneRoundHotBodies) {
  double before = 0;
  for (const test::HotScene& scene : test::hot_scenes()) {
    before += halo_of(scene, HaloRule::none());
    EXPECT_LT(halo_of(scene, {}), 0.5) << scene.name;
  }
  EXPECT_GT(before, 10) << "these scenes show none anyway";
}

/// Dark clothes before bright ground, warm in the thermal image: no halo must not mean no heat.
TEST(BestHalo, APersonStaysHot) {
  cv::Mat1f visible(240, 320, 200.0F), thermal(240, 320, 60.0F);
  visible(cv::Rect(150, 90, 20, 60)) = 40;
  thermal(cv::Rect(150, 90, 20, 60)) = 240;
  const Plane fused = fuse_best(Plane(visible), Plane(thermal), {}).value();
  EXPECT_GT(fused(120, 160), 200);
  EXPECT_NEAR(fused(120, 60), 200, 8);
}

/// Without temperature, on plain ground of either brightness and any thermal level: a sign, a lid.
TEST(BestHalo, AMarkOfTheVisibleImageStays) {
  for (const float ground : {40.0F, 68.0F, 90.0F, 150.0F})
    for (const float level : {10.0F, 220.0F}) {
      cv::Mat1f visible(240, 320, 80.0F), thermal(240, 320, ground);
      visible(cv::Rect(150, 100, 30, 30)) = level;
      const Plane fused = fuse_best(Plane(visible), Plane(thermal), {}).value();
      EXPECT_NEAR(fused(115, 165), level, 12) << "on " << ground;
    }
}

/// Also where something hot makes the thermal image's the plain ground.
TEST(BestHalo, AMarkBesideSomethingHotStandsOut) {
  cv::Mat1f visible(120, 160, 82.0F), thermal(120, 160, 40.0F);
  visible(cv::Rect(20, 40, 30, 30)) = 220;
  cv::circle(thermal, {120, 60}, 15, 230, cv::FILLED);
  const Plane fused = fuse_best(Plane(visible), Plane(thermal), {}).value();
  EXPECT_GT(cv::mean(fused(cv::Rect(25, 45, 20, 20)))[0], 120);
  EXPECT_GT(cv::mean(fused(cv::Rect(112, 52, 16, 16)))[0], 200);
}

/// Few levels above its surroundings, but far above what varies there.
TEST(BestHalo, APersonInADimThermalImageStaysBrighter) {
  cv::Mat1f visible(240, 320, 50.0F), thermal(240, 320, 90.0F);
  cv::RNG random(3);
  random.fill(visible, cv::RNG::NORMAL, 50, 12);
  thermal(cv::Rect(150, 90, 12, 36)) = 150;
  const Plane fused = fuse_best(Plane(visible), Plane(thermal), {}).value();
  EXPECT_GT(cv::mean(fused(cv::Rect(153, 96, 6, 24)))[0], 110);
}

TEST(SmallThings, NarrowOnesOnly) {
  Plane thermal(240, 320, 50.0F);
  thermal(cv::Rect(60, 100, 30, 50)) = 250;
  thermal.colRange(200, 320) = 250;
  const Plane heat = small_heat(thermal, 1);
  EXPECT_GT(heat(125, 75), 0.99F);
  EXPECT_LT(heat(125, 260), 0.01F) << "half of the picture is no small thing";
  EXPECT_LT(heat(30, 30), 0.01F);
  EXPECT_EQ(cv::norm(small_heat(thermal, 0)), 0);
  Plane visible(240, 320, 120.0F);
  visible(cv::Rect(60, 100, 30, 30)) = 250;
  visible(cv::Rect(160, 100, 30, 30)) = 0;
  const Plane marks = small_marks(visible, 40);
  for (const auto& [x, share] : {std::pair(75, 1.0F), {175, 1.0F}, {125, 0.0F}})
    EXPECT_NEAR(marks(115, x), share, 0.01F) << x;
  EXPECT_EQ(cv::norm(small_marks(visible, 0)), 0);
  for (const float level : {0.0F, 1e-20F, 1e15F}) {
    EXPECT_TRUE(cv::checkRange(small_heat(thermal * level, 1), true, nullptr, 0, 1 + 1e-6));
    EXPECT_TRUE(cv::checkRange(small_marks(thermal * level, 1), true, nullptr, 0, 1 + 1e-6));
  }
  EXPECT_EQ(small_heat(Plane(1, 3, 9.0F), 1).size(), cv::Size(3, 1));
}

TEST(PlainRegions, AValueSpreadsToTheNextEdgeAndNoFurther) {
  Plane value(20, 40, 0.0F), own(20, 40, 0.01F), v(20, 40, 50.0F), t(20, 40, 50.0F);
  v(cv::Rect(20, 0, 20, 20)) = 150;
  value(10, 10) = 1;
  own(10, 10) = 100;
  own(cv::Rect(20, 0, 20, 20)) = 1;
  const Plane spread = within_regions(value, own, v, t, {1, 10, 400});
  EXPECT_GT(spread(10, 16), 0.1F);
  EXPECT_LT(spread(10, 21), 1e-3F);
}

TEST(PlainRegions, ExtremeSourcesGiveFiniteValues) {
  for (const float level : {0.0F, 1e-20F, 1e15F}) {
    Plane v(9, 7, 0.0F);
    v(4, 3) = level;
    EXPECT_TRUE(cv::checkRange(within_regions(v, v * 0 + 1, v, v, {2, 6, 10}))) << level;
  }
}

TEST(SettleLevels, ALevelOfASourceStaysAndOneBetweenMoves) {
  const Plane v(64, 64, 200.0F), t(64, 64, 40.0F), none = Plane::zeros(64, 64), all(64, 64, 1.0F);
  const auto settled = [&](float level, const Plane& heat, const Plane& marks) {
    return settle_levels(Plane(64, 64, level), v, t, heat, marks)(32, 32);
  };
  EXPECT_NEAR(settled(200, none, none), 200, 1e-3);
  EXPECT_NEAR(settled(150, none, none), 196, 1);
  EXPECT_NEAR(settled(60, none, all), 196, 1) << "a mark of the visible image";
  EXPECT_NEAR(settled(20, all, none), 36, 1);
  EXPECT_NEAR(settled(120, all, none), 120, 1) << "heat is never darkened";
  for (const int side : {16, 17, 19}) {
    const Plane zero = Plane::zeros(side, side);
    EXPECT_EQ(
        settle_levels(Plane(side, side, 9.0F), zero, Plane(side, side, 99.0F), zero, zero).size(),
        cv::Size(side, side));
  }
}

}  // namespace
}  // namespace orbitfuse::fusion
