// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/similarity_search.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "tests/support/thermal_orbit.hpp"

namespace orbitfuse {
namespace {

using testing_orbit::ThermalOrbit;

Similarity3d off_by(double degrees, const Eigen::Vector3d& axis, double scale) {
  return {scale,
          Eigen::Quaterniond(Eigen::AngleAxisd(degrees * EIGEN_PI / 180, axis.normalized())),
          {0.01, -0.01, 0.01}};
}

/// What is left of the error, as a similarity of the visible world.
Similarity3d left(const SimilarityRefinement& refined, const ThermalOrbit& orbit) {
  return refined.visible_from_thermal * orbit.visible_from_thermal.inverse();
}

double turn_deg(const Similarity3d& s) {
  return rotation_angle_deg(s.rotation, Eigen::Quaterniond::Identity());
}

/// Warm and cold lines that the visible scene knows nothing of, as background and reflections
/// give them, over views of a short arc: places that look alike are many.
ThermalOrbit cluttered_arc() {
  ThermalOrbit orbit(10);
  std::mt19937 random(3);
  const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
  for (cv::Mat& image : orbit.images)
    for (int line = 0; line < 60; ++line) {
      const int thickness = 1 + below(3);
      const double value = 0.3 + 0.01 * below(70);
      const int x0 = below(320), y0 = below(240), x1 = below(320), y1 = below(240);
      cv::line(image, {x1, y1}, {x0, y0}, cv::Scalar(value), thickness);
    }
  return orbit;
}

TEST(SimilaritySearch, ComesHomeFromWhereOneStartDoesNot) {
  const ThermalOrbit orbit = cluttered_arc();
  const Similarity3d start = off_by(8, {1, 0.3, 0.2}, 1.05) * orbit.visible_from_thermal;
  const auto single = refine_similarity(testing_orbit::box_renderer(), orbit.images, orbit.views,
                                        start, similarity_rounds(), {});
  ASSERT_TRUE(single) << single.error().message();
  ASSERT_GT(turn_deg(left(*single, orbit)), 2) << "one start is enough: this shows nothing";
  const auto searched =
      search_similarity(testing_orbit::box_renderer(), orbit.images, orbit.views, start, {}, {});
  ASSERT_TRUE(searched) << searched.error().message();
  EXPECT_TRUE(searched->improved);
  EXPECT_FALSE(searched->unseen);
  EXPECT_EQ(searched->starts, 9);
  EXPECT_GT(searched->agreement_after, single->agreement_after);
  const Similarity3d error = left(*searched, orbit);
  EXPECT_NEAR(error.scale, 1, 0.008);
  EXPECT_LT(turn_deg(error), 0.6);
  EXPECT_LT(error.translation.norm(), 0.01);
}

TEST(SimilaritySearch, ADecisiveAnswerOfTheCloudsIsNotSearchedRound) {
  const ThermalOrbit orbit;
  const Similarity3d start = off_by(1, {0.3, 0.2, 1}, 1.005) * orbit.visible_from_thermal;
  SimilaritySearchOptions options;
  options.clouds_decide = true;
  const auto found = search_similarity(testing_orbit::box_renderer(), orbit.images, orbit.views,
                                       start, options, {});
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_EQ(found->starts, 1);
  ASSERT_EQ(found->skips.size(), 1U);
  EXPECT_EQ(found->skips[0].effect, "8 starts not tried");
  EXPECT_TRUE(found->improved);
  EXPECT_FALSE(found->unseen);
  EXPECT_LT(turn_deg(left(*found, orbit)), 0.3);
  EXPECT_NEAR(left(*found, orbit).scale, 1, 0.004);
}

TEST(SimilaritySearch, CloudsThatTheImagesShiftAreNotConfirmed) {
  const ThermalOrbit orbit;
  // Neither turned nor grown, but off by more than a step of the search.
  const Similarity3d shift{1, Eigen::Quaterniond::Identity(), {0.04, -0.04, 0.04}};
  SimilaritySearchOptions options;
  options.clouds_decide = true;
  const auto found = search_similarity(testing_orbit::box_renderer(), orbit.images, orbit.views,
                                       shift * orbit.visible_from_thermal, options, {});
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_EQ(found->starts, 9);
  EXPECT_TRUE(found->skips.empty());
  EXPECT_TRUE(found->improved);
  EXPECT_LT(left(*found, orbit).translation.norm(), 0.01);
}

TEST(SimilaritySearch, NothingToSeeLeavesTheCloudsAnswer) {
  ThermalOrbit orbit;
  for (cv::Mat& image : orbit.images) image = cv::Scalar(295.15);
  const auto found = search_similarity(testing_orbit::box_renderer(), orbit.images, orbit.views,
                                       orbit.visible_from_thermal, {}, {});
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_FALSE(found->improved);
  EXPECT_TRUE(found->unseen);
  EXPECT_EQ(found->visible_from_thermal.matrix(), orbit.visible_from_thermal.matrix());
}

TEST(SimilaritySearch, NoViewsLeaveItToo) {
  const Similarity3d clouds{2, Eigen::Quaterniond::Identity(), {1, 2, 3}};
  const auto found = search_similarity(testing_orbit::box_renderer(), {}, {}, clouds, {}, {});
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->improved);
  EXPECT_FALSE(found->unseen) << "nobody looked";
  EXPECT_EQ(found->visible_from_thermal.matrix(), clouds.matrix());
}

TEST(SimilaritySearch, BadInputIsNamed) {
  const ThermalOrbit orbit;
  const auto counts = search_similarity(testing_orbit::box_renderer(), {}, orbit.views, {}, {}, {});
  ASSERT_FALSE(counts);
  EXPECT_EQ(counts.error().kind, ErrorKind::input);
  SimilaritySearchOptions options;
  options.turn_deg = std::nan("");
  const auto turn =
      search_similarity(testing_orbit::box_renderer(), orbit.images, orbit.views, {}, options, {});
  ASSERT_FALSE(turn);
  EXPECT_EQ(turn.error().kind, ErrorKind::usage);
  EXPECT_EQ(turn.error().where, "similarity_search.turn_deg");
  const SceneRenderer fails = [](const Camera&, const Rigid3d&) -> Result<SceneRender> {
    return fail(ErrorKind::input, "field", "broken", "train again");
  };
  const auto rendered = search_similarity(fails, orbit.images, orbit.views, {}, {}, {});
  ASSERT_FALSE(rendered);
  EXPECT_EQ(rendered.error().where, "field");
}

}  // namespace
}  // namespace orbitfuse
