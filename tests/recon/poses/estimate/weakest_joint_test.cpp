// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/weakest_joint.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <random>

#include "recon/poses/estimate/weakly_held.hpp"

namespace orbitfuse {
namespace {

using ::testing::ElementsAre;

class Joints {
 public:
  explicit Joints(int views) {
    for (int v = 0; v < views; ++v) {
      PosedView view;
      view.name = std::to_string(v);
      model.views.push_back(view);
    }
  }
  /// Points that all of the views see.
  void share(const std::vector<int>& views, int points) {
    for (int p = 0; p < points; ++p) {
      SparsePoint point;
      point.position.setZero();
      for (const int v : views) {
        Observation seen;
        seen.view = v;
        seen.pixel.setZero();
        point.track.push_back(seen);
      }
      model.points.push_back(point);
    }
  }
  /// Neighbours in the recording see each other's points; the last sees none of the first's.
  void walk(int first, int count, int points) {
    for (int v = first; v + 2 < first + count; ++v) share({v, v + 1, v + 2}, points);
  }
  Reconstruction model;
};

TEST(WeakestJoint, OfTwoWalksIsWhereFewPointsJoinThem) {
  Joints two(14);
  two.walk(0, 8, 100);
  two.walk(8, 6, 100);
  two.share({2, 3, 10}, 20);
  two.share({4, 9, 11}, 15);
  const Joint joint = weakest_joint(two.model);
  EXPECT_EQ(joint.points, 35);
  EXPECT_EQ(joint.views_beyond, 6);
  EXPECT_THAT(joint.beyond, ElementsAre(0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1));
  EXPECT_TRUE(joint.loose());

  two.share({2, 3, 10}, 100);  // now they know each other
  EXPECT_FALSE(weakest_joint(two.model).loose());
}

TEST(WeakestJoint, AWalkIsNoLooserForItsLength) {
  for (const int views : {8, 60, 300}) {
    Joints walk(views);
    walk.walk(0, views, 50);
    const Joint joint = weakest_joint(walk.model);
    EXPECT_FALSE(joint.loose()) << views << ": " << joint.share;
  }
}

TEST(WeakestJoint, DoesNotDependOnTheOrderOfViewsOrPoints) {
  std::vector<int> place(14);
  std::iota(place.begin(), place.end(), 0);
  std::mt19937 rng(3);
  std::shuffle(place.begin(), place.end(), rng);
  const auto at_place = [&](int v) { return place[static_cast<std::size_t>(v)]; };
  Joints mixed(14);
  for (const int first : {0, 8})
    for (int v = first; v + 2 < (first == 0 ? 8 : 14); ++v)
      mixed.share({at_place(v), at_place(v + 1), at_place(v + 2)}, 100);
  mixed.share({at_place(2), at_place(3), at_place(10)}, 30);
  std::shuffle(mixed.model.points.begin(), mixed.model.points.end(), rng);
  const Joint joint = weakest_joint(mixed.model);
  EXPECT_EQ(joint.points, 30);
  for (int v = 0; v < 14; ++v)
    EXPECT_EQ(joint.beyond[static_cast<std::size_t>(at_place(v))] != 0, v >= 8) << v;
}

/// Each pair across holds a direction, and a scale of its own.
TEST(WeakestJoint, OfPointsOfTwoViewsIsLoose) {
  Joints two(14);
  two.walk(0, 8, 100);
  two.walk(8, 6, 100);
  for (const int v : {0, 3, 6}) two.share({v, 8 + v / 2}, 40);
  two.share({4, 9, 11}, 15);
  const Joint joint = weakest_joint(two.model);
  EXPECT_EQ(joint.points, 15);
  EXPECT_EQ(joint.views_of_point, 3);
  EXPECT_EQ(joint.views_beyond, 6);
  EXPECT_TRUE(joint.loose());

  two.share({4, 9, 11}, 100);
  EXPECT_FALSE(weakest_joint(two.model).loose());
}

TEST(WeakestSureJoint, ADoubtfulViewJoinsNoParts) {
  Joints two(13);
  two.walk(0, 6, 100);
  two.walk(7, 6, 100);
  for (int v = 4; v <= 6; ++v) two.share({v, v + 1, v + 2}, 100);
  EXPECT_FALSE(weakest_sure_joint(two.model, {}).loose());
  const Joint joint =
      weakest_sure_joint(two.model, {{"6", DoubtReason::few_common_points, "for the test"}});
  EXPECT_TRUE(joint.loose());
  EXPECT_EQ(joint.points, 0);
  EXPECT_EQ(joint.views_beyond, 6);
  EXPECT_EQ(joint.beyond.size(), 13u);
  EXPECT_EQ(joint.beyond[6], 0);
  EXPECT_NE(joint.beyond[5], joint.beyond[7]);
}

TEST(WeakestJoint, PartsThatNothingJoinsAreLoose) {
  Joints apart(10);
  apart.walk(0, 5, 40);
  apart.walk(5, 5, 40);
  const Joint joint = weakest_joint(apart.model);
  EXPECT_EQ(joint.points, 0);
  EXPECT_EQ(joint.views_beyond, 5);
  EXPECT_TRUE(joint.loose());
}

TEST(WeakestJoint, OfFewViewsOrNoPointsThereIsNone) {
  EXPECT_FALSE(weakest_joint({}).loose());
  EXPECT_FALSE(weakest_joint(Joints(12).model).loose());
  Joints five(5);
  five.walk(0, 5, 3);
  EXPECT_FALSE(weakest_joint(five.model).loose());
}

/// A frame whose features are the scene's from `first` on, with descriptors that only equal ones
/// are like.
Descriptors descriptors_from(int first, int count) {
  Descriptors rows = Descriptors::Zero(count, 128);
  for (int i = 0; i < count; ++i) {
    std::mt19937 rng(static_cast<unsigned>(first + i));
    for (int k = 0; k < 8; ++k) rows(i, static_cast<Eigen::Index>(rng() % 128)) = 181;
  }
  return rows;
}

TEST(LikelyPairs, AreThoseAcrossThatWereNotMatchedAndLookAlike) {
  Joints two(6);
  FeatureGraph graph;
  std::vector<FrameRecord> frames(6);
  for (int f = 0; f < 6; ++f) {
    frames[static_cast<std::size_t>(f)].file = std::to_string(f);
    graph.frames.push_back(&frames[static_cast<std::size_t>(f)]);
    // Frames 1 and 4 show the same 60 features, 2 and 5 have 10 in common, others none.
    const int first = f == 4 ? 1000 : f == 5 ? 2050 : 1000 * f;
    graph.descriptors.push_back(descriptors_from(first, 60));
  }
  Joint joint;
  joint.beyond = {0, 0, 0, 1, 1, 1};
  EXPECT_THAT(likely_pairs_across(graph, two.model, joint, {}).value(),
              ElementsAre(ViewPair(1, 4)));
  const std::atomic<bool> stop = true;
  Progress stopping;
  stopping.cancel = &stop;
  const auto stopped = likely_pairs_across(graph, two.model, joint, stopping);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::cancelled);
  graph.proposed[{1, 4}] = {};
  EXPECT_TRUE(likely_pairs_across(graph, two.model, joint, {}).value().empty());
}

}  // namespace
}  // namespace orbitfuse
