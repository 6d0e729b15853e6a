// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/orbit_search.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "recon/alignment/edge_field.hpp"

namespace orbitfuse {
namespace {

constexpr double pi = 3.14159265358979323846;

Camera small_camera() {
  Camera camera;
  camera.width = 320, camera.height = 240;
  camera.fx = camera.fy = 500, camera.cx = 160, camera.cy = 120;
  return camera;
}

/// A wire scene without symmetry: a box, a mast at one corner, a ramp on one side.
std::vector<EdgeLine> wires() {
  std::vector<EdgeLine> lines;
  const auto add = [&](Eigen::Vector3d a, Eigen::Vector3d b) {
    lines.push_back({a, b, {0, 1, 2}});
  };
  const Eigen::Vector3d low(-0.35, -0.2, -0.15), high(0.35, 0.2, 0.15);
  for (int corner = 0; corner < 8; ++corner)
    for (int axis = 0; axis < 3; ++axis) {
      if (corner >> axis & 1) continue;
      Eigen::Vector3d a, b;
      for (int k = 0; k < 3; ++k) a[k] = (corner >> k & 1) ? high[k] : low[k];
      b = a;
      b[axis] = high[axis];
      add(a, b);
    }
  add({0.35, 0.2, 0.15}, {0.35, 0.2, 0.45});
  add({0.35, 0.2, 0.45}, {0.1, 0.2, 0.45});
  add({0.35, -0.2, 0.15}, {0.6, -0.2, -0.15});
  add({0.35, 0.0, 0.15}, {0.6, 0.0, -0.15});
  add({-0.1, 0.2, -0.1}, {0.2, 0.2, 0.1});
  return lines;
}

/// All lines are seen from everywhere: directions on a dense sphere.
LineModel wire_model() {
  std::vector<Eigen::Vector3d> centers;
  std::vector<EdgeLine> lines = wires();
  std::vector<int> all;
  for (int i = 0; i < 12; ++i)
    for (const double z : {0.1, 1.0}) {
      all.push_back(static_cast<int>(centers.size()));
      centers.push_back({2 * std::cos(i * pi / 6), 2 * std::sin(i * pi / 6), z});
    }
  for (EdgeLine& line : lines) line.views = all;
  return {lines, centers};
}

/// The edges as a perfect detector would give them: each line a Gaussian ridge of orientation.
cv::Mat ridges(const Rigid3d& cam_from_world, double sigma_px) {
  cv::Mat field(240, 320, CV_32FC2, cv::Scalar::all(0));
  for (const EdgeLine& line : wires()) {
    const Eigen::Vector2d a = small_camera().project(cam_from_world * line.a);
    const Eigen::Vector2d b = small_camera().project(cam_from_world * line.b);
    const double length = (b - a).norm();
    const Eigen::Vector2d along = (b - a) / length, normal(-along.y(), along.x());
    const float c = static_cast<float>(normal.x() * normal.x() - normal.y() * normal.y());
    const float s = static_cast<float>(2 * normal.x() * normal.y());
    for (int y = 0; y < field.rows; ++y)
      for (int x = 0; x < field.cols; ++x) {
        const Eigen::Vector2d p = Eigen::Vector2d(x + 0.5, y + 0.5) - a;
        const double across = normal.dot(p), t = along.dot(p);
        if (t < 0 || t > length || std::abs(across) > 4 * sigma_px) continue;
        const auto w = static_cast<float>(std::exp(-0.5 * across * across / (sigma_px * sigma_px)));
        field.at<cv::Vec2f>(y, x) += cv::Vec2f(w * c, w * s);
      }
  }
  return field;
}

OrbitPose true_pose(int station) {
  OrbitPose pose;
  pose.azimuth_deg = 75 + 45 * station + 3 * ((station * 5) % 3 - 1);
  pose.elevation_deg = 20;
  pose.radius = 1.5;
  return pose;
}

TEST(OrbitPose, RoundTripsThroughItsCamera) {
  const OrbitPose pose = true_pose(2);
  const Rigid3d cam = cam_from_world_of(pose, small_camera());
  EXPECT_NEAR(camera_center(cam).norm(), pose.radius, 1e-12);
  EXPECT_LT(
      (small_camera().project(cam * Eigen::Vector3d::Zero()) - Eigen::Vector2d(160, 120)).norm(),
      1e-9);
  EXPECT_LT((cam.rotation * Eigen::Vector3d::UnitZ()).y(), 0) << "z is up, image y is down";
  OrbitPose shifted = pose;
  shifted.shift_x_px = 20, shifted.shift_y_px = -10;
  const Eigen::Vector2d origin =
      small_camera().project(cam_from_world_of(shifted, small_camera()) * Eigen::Vector3d::Zero());
  EXPECT_LT((origin - Eigen::Vector2d(180, 110)).norm(), 0.5);
}

TEST(OrbitSearch, FindsTheStartAndDirectionOfAWireOrbit) {
  const LineModel model = wire_model();
  std::vector<SearchView> views;
  std::vector<Station> stations;
  for (int i = 0; i < 8; ++i) {
    SearchView view;
    view.camera = small_camera();
    view.field = ridges(cam_from_world_of(true_pose(i), small_camera()), 2.0);
    Station station;
    station.azimuth_deg = 45 * i;
    stations.push_back(station);
    views.push_back(view);
  }
  OrbitSearchOptions options;
  options.nearest = 1.2, options.farthest = 1.9;
  options.elevations_deg = {12, 20, 28};
  options.columns = 48;
  const auto table = tabulate_orbit(model, views, options, {});
  ASSERT_TRUE(table) << table.error().message();
  const auto found = search_orbit(*table, stations, options);
  ASSERT_FALSE(found.empty());
  EXPECT_FALSE(found.front().mirrored);
  EXPECT_NEAR(std::remainder(found.front().offset_deg - 75, 360), 0, 10);
  ASSERT_EQ(found.front().poses.size(), 8u);
  for (int i = 0; i < 8; ++i)
    EXPECT_NEAR(std::remainder(found.front().poses[static_cast<std::size_t>(i)].azimuth_deg -
                                   true_pose(i).azimuth_deg,
                               360),
                0, 12)
        << "view " << i;
}

/// A table in which each view knows one place only; what a far true orbit with a near impostor in
/// one loop looks like in it.
OrbitTable table_of(std::size_t views, const OrbitSearchOptions& options) {
  OrbitTable table;
  table.azimuths = static_cast<int>(360 / options.azimuth_step_deg);
  table.elevations = static_cast<int>(options.elevations_deg.size());
  for (double r = options.nearest; r <= options.farthest; r *= options.radius_ratio)
    table.radii.push_back(r);
  const auto places =
      static_cast<std::size_t>(table.azimuths * table.elevations) * table.radii.size();
  table.of_view.assign(views, std::vector<OrbitPeak>(places, OrbitPeak{0.05F, 0, 0}));
  return table;
}

TEST(OrbitSearch, ALoopDoesNotLeaveTheCommonDistanceForASlightlyBetterScore) {
  // As measured: the lower loop scores .269 at half the distance, .254 at the true one.
  OrbitSearchOptions options;
  options.hypotheses = 4;
  OrbitTable table = table_of(24, options);
  const auto nearest_radius = [&](double wanted) {
    std::size_t best = 0;
    for (std::size_t r = 0; r < table.radii.size(); ++r)
      if (std::abs(table.radii[r] - wanted) < std::abs(table.radii[best] - wanted)) best = r;
    return best;
  };
  const std::size_t far = nearest_radius(2.2), near = nearest_radius(1.12);
  const auto set = [&](std::size_t view, int azimuth, std::size_t elevation, std::size_t radius,
                       float score) {
    const auto place =
        (static_cast<std::size_t>(azimuth) * options.elevations_deg.size() + elevation) *
            table.radii.size() +
        radius;
    table.of_view[view][place].score = score;
  };
  std::vector<Station> stations(24);
  for (std::size_t i = 0; i < 24; ++i) {
    const auto step = static_cast<int>(i % 12);
    stations[i].loop = static_cast<int>(i / 12), stations[i].azimuth_deg = 30.0 * step;
    const int azimuth = 4 * step;  // of 7.5 deg
    if (i < 12) {
      set(i, azimuth, 0, near, 0.269F);
      set(i, azimuth, 1, far, 0.254F);
    } else {
      set(i, azimuth, 4, far, 0.25F);
    }
  }
  const auto found = search_orbit(table, stations, options);
  ASSERT_FALSE(found.empty());
  for (std::size_t i = 0; i < 24; ++i) {
    EXPECT_EQ(found.front().nominal[i].radius, table.radii[far]) << i;
    EXPECT_EQ(found.front().nominal[i].elevation_deg, i < 12 ? 12 : 37) << i;
  }
  options.distance_cost = 0;
  const auto alone = search_orbit(table, stations, options);
  EXPECT_EQ(alone.front().nominal[0].radius, table.radii[near]) << "nothing else tells them apart";
}

TEST(OrbitSearch, ViewsInOrderAloneMayBeOneLoopOrMore) {
  EXPECT_EQ(station_layouts(8).size(), 1u);
  const auto layouts = station_layouts(24);
  ASSERT_EQ(layouts.size(), 3u);
  EXPECT_EQ(layouts[0][23].loop, 0);
  EXPECT_NEAR(layouts[0][23].azimuth_deg, 345, 1e-9);
  EXPECT_EQ(layouts[1][12].loop, 1);
  EXPECT_NEAR(layouts[1][12].azimuth_deg, 0, 1e-9);
  EXPECT_NEAR(layouts[1][13].azimuth_deg, 30, 1e-9);
  EXPECT_EQ(layouts[2][23].loop, 2);
  EXPECT_NEAR(layouts[2][23].azimuth_deg, 315, 1e-9);
}

TEST(EdgeField, IsBlindToTheSignOfContrast) {
  cv::Mat image(240, 320, CV_32F, cv::Scalar(300));
  cv::rectangle(image, cv::Rect(100, 60, 90, 70), cv::Scalar(310), cv::FILLED);
  cv::circle(image, {150, 150}, 40, cv::Scalar(305), cv::FILLED);
  const cv::Mat negative = 600.0 - image;
  EXPECT_LT(cv::norm(orientation_field(image, 1.5), orientation_field(negative, 1.5), cv::NORM_INF),
            1e-3);
}

TEST(EdgeField, NothingToSeeIsZeroAndFinite) {
  const cv::Mat constant(60, 80, CV_32F, cv::Scalar(295));
  EXPECT_EQ(cv::norm(orientation_field(constant, 1.5)), 0.0);
  cv::Mat invalid(60, 80, CV_32F, cv::Scalar(std::nan("")));
  EXPECT_EQ(cv::norm(orientation_field(invalid, 1.5)), 0.0);
}

}  // namespace
}  // namespace orbitfuse
