// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/mirrored_views.hpp"

#include <gtest/gtest.h>

#include "tests/recon/poses/cross_modal/box_orbit.hpp"

namespace orbitfuse {
namespace {

Result<std::optional<MirroredSupport>> support(bool both, bool mirrored) {
  const testing_orbit::BoxOrbit boxes = testing_orbit::box_orbit(both);
  OrbitViews orbit;
  std::vector<PosedView> blank;
  std::vector<SearchView> search;
  for (cv::Mat image : boxes.images) {
    if (mirrored) cv::flip(image, image, 1);
    search.push_back({orientation_field(image, 1.0), boxes.camera});
    blank.push_back({"view" + std::to_string(blank.size()), boxes.camera, {}});
    orbit.images.push_back(std::move(image));
  }
  const SceneRenderer renderer = testing_orbit::boxes_renderer(both);
  const LineModel lines = testing_orbit::box_lines(both);
  OrbitSearchOptions options;
  options.nearest = testing_orbit::box_orbit_radius / 1.12;
  options.farthest = testing_orbit::box_orbit_radius * 1.13;
  ORBITFUSE_ASSIGN(const OrbitTable table, tabulate_orbit(lines, search, options, {}));
  const std::vector<OrbitHypothesis> hypotheses = search_orbit(table, boxes.stations, options);
  ORBITFUSE_ASSIGN(const SelectedOrbit selected,
                   select_by_renders(renderer, orbit, blank, hypotheses, {}));
  return support_if_mirrored(
      renderer, {lines, search, orbit, blank, hypotheses[selected.hypothesis], selected}, {});
}

TEST(MirroredViews, AreToldWhereTheSceneIsNotItsOwnMirrorImage) {
  const auto mirrored = support(true, true);
  ASSERT_TRUE(mirrored) << mirrored.error().message();
  ASSERT_TRUE(*mirrored);
  EXPECT_TRUE((*mirrored)->told())
      << (*mirrored)->lead_standard_errors << " " << (*mirrored)->ratio;
  const auto right = support(true, false);
  ASSERT_TRUE(right) << right.error().message();
  EXPECT_LT(right->value_or(MirroredSupport{-9, 0}).lead_standard_errors, 0);
}

TEST(MirroredViews, OfASceneThatIsItsOwnMirrorImageNothingIsTold) {
  const auto alike = support(false, true);
  ASSERT_TRUE(alike) << alike.error().message();
  EXPECT_FALSE(alike->value_or(MirroredSupport{}).told());
}

}  // namespace
}  // namespace orbitfuse
