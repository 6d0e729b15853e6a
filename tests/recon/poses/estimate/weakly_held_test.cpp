// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/weakly_held.hpp"

#include <gmock/gmock.h>

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

TEST(WeaklyHeld, PointsOfTwoViewsHoldNoScale) {
  EXPECT_TRUE(weakly_held(chain(5, 200, 60), 50).empty());
  const auto weak = weakly_held(chain(5, 200, 30), 50);
  ASSERT_EQ(weak.size(), 2u) << "the ends alone: the others are in two or three rows";
  EXPECT_EQ(weak[0].name, "0");
  EXPECT_EQ(weak[1].name, "4");
  EXPECT_EQ(weak[0].reason, DoubtReason::few_common_points);
  EXPECT_THAT(weak[0].why, HasSubstr("30 of its points"));
}

TEST(WeaklyHeld, TwoViewsHaveNoThirdToAsk) {
  EXPECT_TRUE(weakly_held(chain(2, 3, 0), 50).empty());
  EXPECT_TRUE(weakly_held({}, 50).empty());
}

}  // namespace
}  // namespace orbitfuse
