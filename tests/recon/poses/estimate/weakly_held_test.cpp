// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/weakly_held.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <random>

#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

using ::testing::HasSubstr;

/// A chain of views: each neighbouring pair shares `pairs` points, each three in a row `triples`.
Reconstruction chain(int views, int pairs, int triples) {
  Reconstruction model;
  for (int v = 0; v < views; ++v) {
    PosedView view;
    view.name = std::to_string(v);
    model.views.push_back(view);
  }
  const auto add = [&](int first, int count, int points) {
    for (int p = 0; p < points; ++p) {
      SparsePoint point;
      point.position.setZero();
      for (int v = first; v < first + count; ++v) {
        Observation seen;
        seen.view = v;
        seen.pixel.setZero();
        point.track.push_back(seen);
      }
      model.points.push_back(point);
    }
  };
  for (int v = 0; v + 1 < views; ++v) add(v, 2, pairs);
  for (int v = 0; v + 2 < views; ++v) add(v, 3, triples);
  return model;
}

/// Counts alone decide: the chain's points lie nowhere.
WeaklyHeldOptions at_least(int points) { return {points, std::numeric_limits<double>::infinity()}; }

TEST(WeaklyHeld, PointsOfTwoViewsHoldNoScale) {
  EXPECT_TRUE(weakly_held(chain(5, 200, 60), at_least(50)).empty());
  const auto weak = weakly_held(chain(7, 200, 30), at_least(31));
  // The ends first; then what the ends vouched for has no more than the ends had.
  ASSERT_GE(weak.size(), 2u);
  EXPECT_EQ(weak.front().name, "0");
  EXPECT_EQ(weak.back().name, "6");
  EXPECT_EQ(weak.front().reason, DoubtReason::few_common_points);
  EXPECT_THAT(weak.front().why, HasSubstr("30 of its points"));
}

TEST(WeaklyHeld, ADoubtfulViewVouchesForNoOther) {
  Reconstruction model = chain(5, 200, 60);
  // View 4's only points of three are shared with view 3, most of whose are shared with view 4.
  const auto all = weakly_held(model, at_least(61));
  const auto none = weakly_held(model, at_least(60));
  EXPECT_TRUE(none.empty());
  // Without the ends (60 each), their neighbours have 60 of their 120, and so on inwards.
  EXPECT_EQ(all.size(), 5u);
}

TEST(WeaklyHeld, AViewThatItsPointsLeaveRoomIsNamed) {
  Reconstruction model = testing_orbit::seen_cube(testing_orbit::two_loops(), 300, 0.5);
  EXPECT_TRUE(weakly_held(model).empty());
  // Of view 7 a tenth of the points, in a corner of the image, and pixels ten times as far off.
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 5);
  for (SparsePoint& point : model.points)
    std::erase_if(point.track, [&](Observation& o) {
      if (o.view != 7) return false;
      const bool far = o.pixel.x() > 290 || o.pixel.y() > 230;
      o.pixel += Eigen::Vector2d(noise(random), noise(random));
      return far;
    });
  const auto weak = weakly_held(model);
  ASSERT_EQ(weak.size(), 1u);
  EXPECT_EQ(weak[0].name, "view7");
  EXPECT_EQ(weak[0].reason, DoubtReason::uncertain_place);
  EXPECT_THAT(weak[0].why, HasSubstr("% of the orbit's radius"));
}

TEST(WeaklyHeld, BeyondALooseJointAllAreDoubtedOnce) {
  const Reconstruction model = chain(5, 200, 60);
  Joint joint;
  joint.beyond = {0, 0, 0, 1, 1};
  joint.views_beyond = 2, joint.points = 7, joint.share = 0.1;
  std::vector<DoubtfulView> doubtful = {{"4", DoubtReason::uncertain_place, "known before"}};
  doubt_beyond(joint, model, doubtful);
  ASSERT_EQ(doubtful.size(), 2u);
  EXPECT_EQ(doubtful[0].why, "known before");
  EXPECT_EQ(doubtful[1].name, "3");
  EXPECT_THAT(doubtful[1].why, HasSubstr("7 points join it and 1 more"));
  joint.share = 0.3;
  doubtful.clear();
  doubt_beyond(joint, model, doubtful);
  EXPECT_TRUE(doubtful.empty());
}

TEST(WeaklyHeld, AMinorityVouchesForNothing) {
  const Reconstruction model = chain(5, 200, 60);
  std::vector<DoubtfulView> doubtful;
  for (const int v : {0, 3})
    doubtful.push_back(
        {model.views[static_cast<std::size_t>(v)].name, DoubtReason::few_common_points, "before"});
  doubt_minority(model, doubtful);
  EXPECT_EQ(doubtful.size(), 2u);
  doubtful.push_back({model.views[1].name, DoubtReason::few_common_points, "before"});
  doubt_minority(model, doubtful);
  ASSERT_EQ(doubtful.size(), 5u);
  EXPECT_EQ(doubtful[0].why, "before");
  EXPECT_THAT(doubtful[4].why, HasSubstr("3 of 5 views are in doubt"));
}

TEST(WeaklyHeld, TwoViewsHaveNoThirdToAsk) {
  EXPECT_TRUE(weakly_held(chain(2, 3, 0)).empty());
  EXPECT_TRUE(weakly_held({}).empty());
}

}  // namespace
}  // namespace orbitfuse
