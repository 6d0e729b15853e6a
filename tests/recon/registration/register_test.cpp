// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/register.hpp"

#include <gtest/gtest.h>

#include "core/system/parallel.hpp"
#include "tests/recon/registration/shapes.hpp"
#include "tests/support/cloud_scenes.hpp"

namespace orbitfuse {
namespace {

using namespace orbitfuse::testing;

bool is_right(const Similarity3d& found, const Similarity3d& truth) {
  return rotation_angle_deg(found.rotation, truth.rotation) < 5 &&
         std::abs(found.scale / truth.scale - 1) < 0.05;
}

/// A fast part of the suite in bench/registration: the levels whose bar is 100 %, other seeds.
class Suite : public ::testing::TestWithParam<std::string> {};

TEST_P(Suite, FindsTheTruth) {
  const auto surface = scenes::surface(GetParam());
  if (!surface) GTEST_SKIP() << GetParam() << " is not in the shared data";
  std::uint32_t seed = 900001;
  for (const scenes::Level& level : scenes::levels()) {
    if (level.success_bar < 1) continue;
    const scenes::CloudPair pair = scenes::make_pair(*surface, level, ++seed);
    const auto report = register_clouds(pair.source, pair.target, {}, {});
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_TRUE(is_right(report->target_from_source, pair.target_from_source))
        << level.name << ": " << report->brief();
    EXPECT_GT(report->score, 0.2) << level.name;
  }
}
INSTANTIATE_TEST_SUITE_P(Clouds, Suite, ::testing::Values("bunny", "indoor", "car"));

scenes::CloudPair indoor_pair(std::uint32_t seed) {
  return scenes::make_pair(*scenes::surface("indoor"), scenes::levels()[1], seed);
}

TEST(Register, SameSeedSameAnswerForAnyThreadCount) {
  const scenes::CloudPair pair = indoor_pair(5);
  set_thread_count(1);
  const auto a = register_clouds(pair.source, pair.target, {}, {});
  set_thread_count(2);
  const auto b = register_clouds(pair.source, pair.target, {}, {});
  set_thread_count(0);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->target_from_source.matrix(), b->target_from_source.matrix());
  EXPECT_EQ(a->score, b->score);
  EXPECT_EQ(a->brief(), b->brief());
}

TEST(Register, SecondInitialiserIsSkippedWhenTheFirstIsDecisive) {
  const scenes::CloudPair pair = indoor_pair(6);
  RegistrationOptions options;
  options.estimate_warp = false;  // has a skip of its own
  const auto quick = register_clouds(pair.source, pair.target, options, {});
  ASSERT_TRUE(quick);
  ASSERT_EQ(quick->skips.size(), 1u);
  options.decisive_score = 1;
  const auto thorough = register_clouds(pair.source, pair.target, options, {});
  ASSERT_TRUE(thorough);
  EXPECT_TRUE(thorough->skips.empty());
  EXPECT_TRUE(is_right(thorough->target_from_source, pair.target_from_source));
}

TEST(Register, EachInitialiserAloneFindsTheTruth) {
  const scenes::CloudPair pair = indoor_pair(11);
  for (const bool features : {true, false}) {
    RegistrationOptions options;
    options.use_features = features;
    options.use_grid = !features;
    const auto report = register_clouds(pair.source, pair.target, options, {});
    ASSERT_TRUE(report);
    EXPECT_TRUE(is_right(report->target_from_source, pair.target_from_source)) << report->brief();
    EXPECT_EQ(report->initialiser.find("features") == 0, features) << report->initialiser;
  }
}

TEST(Register, TheReverseIsTheInverse) {
  const scenes::CloudPair pair = indoor_pair(7);
  const auto back = register_clouds(pair.target, pair.source, {}, {});
  ASSERT_TRUE(back);
  EXPECT_TRUE(is_right(back->target_from_source.inverse(), pair.target_from_source));
}

TEST(Register, ViewsDecideBetweenPlacementsThatGeometryCannot) {
  // A cube: 24 placements. The views are told which one is right.
  const PointCloud source = drawn(2500, 1, on_cube);
  Random random(3);
  const Similarity3d truth = any_similarity(random);
  const PointCloud target = moved(drawn(2500, 2, on_cube), truth);
  const auto alone = register_clouds(source, target, {}, {});
  ASSERT_TRUE(alone);
  ASSERT_TRUE(alone->ambiguous);
  ASSERT_FALSE(alone->alternatives.empty());
  const Similarity3d wanted = alone->alternatives.back().evidence > 0.9 * alone->evidence
                                  ? alone->alternatives.back().target_from_source
                                  : alone->alternatives.front().target_from_source;
  const ViewScore views = [&](const Similarity3d& s) {
    return -rotation_angle_deg(s.rotation, wanted.rotation);
  };
  const auto decided = register_clouds(source, target, {}, {}, views);
  ASSERT_TRUE(decided);
  EXPECT_LT(rotation_angle_deg(decided->target_from_source.rotation, wanted.rotation), 2);
  EXPECT_TRUE(decided->decided_by_views);
  EXPECT_FALSE(decided->ambiguous) << decided->ambiguity;
  // Views that see no difference decide nothing.
  const auto open =
      register_clouds(source, target, {}, {}, [](const Similarity3d&) { return 0.5; });
  ASSERT_TRUE(open);
  EXPECT_FALSE(open->decided_by_views);
  EXPECT_TRUE(open->ambiguous);
}

TEST(Register, ViewsAreNotAskedWhereGeometryDecides) {
  const scenes::CloudPair pair = indoor_pair(5);
  int asked = 0;
  const auto report = register_clouds(pair.source, pair.target, {}, {}, [&](const Similarity3d&) {
    ++asked;
    return 1.0;
  });
  ASSERT_TRUE(report);
  EXPECT_TRUE(is_right(report->target_from_source, pair.target_from_source));
  EXPECT_EQ(asked, 0);
  EXPECT_FALSE(report->decided_by_views);
}

TEST(Register, RefinementAloneStaysAtTheTruth) {
  const scenes::CloudPair pair = indoor_pair(8);
  const auto report = refine_registration(pair.source, pair.target, pair.target_from_source, {});
  ASSERT_TRUE(report);
  EXPECT_LT(scenes::surface_rmse_percent(pair, report->target_from_source), 0.3);
  EXPECT_GT(report->overlap_source, 0.95);
  EXPECT_GT(report->overlap_target, 0.95);
  EXPECT_LT(report->rmse_percent_of_diameter, 2);
  EXPECT_FALSE(report->ambiguous) << report->ambiguity;
}

TEST(Register, RefinementRefusesAStartThatIsNone) {
  const scenes::CloudPair pair = indoor_pair(9);
  Similarity3d start;
  start.scale = 0;
  EXPECT_FALSE(refine_registration(pair.source, pair.target, start, {}));
  start.scale = std::nan("");
  EXPECT_FALSE(refine_registration(pair.source, pair.target, start, {}));
}

TEST(Register, StopsWhenAsked) {
  const scenes::CloudPair pair = indoor_pair(10);
  std::atomic<bool> cancel{true};
  Progress progress;
  progress.cancel = &cancel;
  const auto report = register_clouds(pair.source, pair.target, {}, progress);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::cancelled);
}

TEST(Options, NameTheWrongField) {
  const auto where = [](const std::function<void(RegistrationOptions&)>& spoil) {
    RegistrationOptions options;
    spoil(options);
    const Status status = options.validate();
    return status ? std::string() : status.error().where;
  };
  EXPECT_EQ(where([](auto&) {}), "");
  EXPECT_EQ(where([](auto& o) { o.points = 5; }), "registration.points");
  EXPECT_EQ(where([](auto& o) { o.max_pair_distance = -1; }), "registration.max_pair_distance");
  EXPECT_EQ(where([](auto& o) { o.inlier_distance = 0.5; }), "registration.inlier_distance");
  EXPECT_EQ(where([](auto& o) { o.min_scale = 0; }), "registration.min_scale");
  EXPECT_EQ(where([](auto& o) { o.max_scale = std::nan(""); }), "registration.max_scale");
  EXPECT_EQ(where([](auto& o) { o.decisive_score = 2; }), "registration.decisive_score");
  EXPECT_EQ(where([](auto& o) { o.ambiguity_ratio = 0; }), "registration.ambiguity_ratio");
  EXPECT_EQ(where([](auto& o) { o.use_features = o.use_grid = false; }), "registration.use_grid");
  EXPECT_EQ(where([](auto& o) { o.restarts = -1; }), "registration.restarts");
}

}  // namespace
}  // namespace orbitfuse
