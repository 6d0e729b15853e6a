// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/mirrored_views.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <numeric>

#include "recon/alignment/edge_field.hpp"
#include "tests/support/box_scene.hpp"
#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

constexpr double radius = 2.5;

/// Where a second box of the same form stands, on one side of the first, which alone is its own
/// mirror image.
const Rigid3d second_from_first{
    Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())), {0.1, -0.55, 0.05}};

SceneRender two_boxes(const Camera& camera, const Rigid3d& cam_from_world, bool hot, bool both) {
  SceneRender seen = testing_orbit::box_view(camera, cam_from_world, hot);
  if (!both) return seen;
  const SceneRender other =
      testing_orbit::box_view(camera, cam_from_world * second_from_first, hot);
  const cv::Mat nearer =
      (other.depth == other.depth) & ((seen.depth != seen.depth) | (other.depth < seen.depth));
  other.brightness.copyTo(seen.brightness, nearer);
  other.depth.copyTo(seen.depth, nearer);
  return seen;
}

/// The edges of each box, seen from everywhere.
LineModel box_lines(bool both) {
  std::vector<Eigen::Vector3d> centers;
  for (int i = 0; i < 12; ++i)
    for (const double z : {0.3, 1.2}) {
      const double a = i * std::numbers::pi / 6;
      centers.emplace_back(radius * std::cos(a), radius * std::sin(a), z);
    }
  std::vector<int> all(centers.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<EdgeLine> lines;
  const auto add = [&](const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    for (int corner = 0; corner < 8; ++corner)
      for (int axis = 0; axis < 3; ++axis) {
        if ((corner >> axis & 1) != 0) continue;
        Eigen::Vector3d a;
        for (int k = 0; k < 3; ++k) a[k] = (corner >> k & 1) != 0 ? high[k] : low[k];
        Eigen::Vector3d b = a;
        b[axis] = high[axis];
        lines.push_back({a, b, all});
        if (both) lines.push_back({second_from_first * a, second_from_first * b, all});
      }
  };
  add({-0.4, -0.15, -0.15}, {0.4, 0.15, 0.15});
  add({0.2, -0.1, 0.15}, {0.35, 0.1, 0.27});
  return {lines, centers};
}

Result<std::optional<MirroredSupport>> support(bool both, bool mirrored) {
  const Camera camera = testing_orbit::camera(1000).scaled_to(320, 240);
  OrbitViews orbit;
  std::vector<PosedView> blank;
  std::vector<SearchView> search;
  std::vector<Station> stations;
  for (int i = 0; i < 16; ++i) {
    Station station;
    station.loop = i / 8, station.azimuth_deg = 45.0 * (i % 8);
    OrbitPose pose;
    pose.azimuth_deg = station.azimuth_deg + 20 + (i % 2 == 0 ? 3 : -3);
    pose.elevation_deg = i < 8 ? 12 : 28, pose.radius = radius;
    cv::Mat image = two_boxes(camera, cam_from_world_of(pose, camera), true, both).brightness;
    if (mirrored) cv::flip(image, image, 1);
    search.push_back({orientation_field(image, 1.0), camera});
    orbit.images.push_back(std::move(image));
    blank.push_back({"view" + std::to_string(i), camera, {}});
    stations.push_back(station);
  }
  const SceneRenderer renderer = [&](const Camera& c, const Rigid3d& pose) -> Result<SceneRender> {
    return two_boxes(c, pose, false, both);
  };
  const LineModel lines = box_lines(both);
  OrbitSearchOptions options;
  options.nearest = radius / 1.12, options.farthest = radius * 1.13;
  ORBITFUSE_ASSIGN(const OrbitTable table, tabulate_orbit(lines, search, options, {}));
  const std::vector<OrbitHypothesis> hypotheses = search_orbit(table, stations, options);
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
