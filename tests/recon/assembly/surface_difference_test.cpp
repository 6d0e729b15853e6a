// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/surface_difference.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orbitfuse {
namespace {

constexpr float none = std::numeric_limits<float>::quiet_NaN();

/// The square [-1, 1] x [-1, 1] at z = 0, facing up, n x n vertices.
TriangleMesh table(int n = 21) {
  TriangleMesh mesh;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i)
      mesh.vertices.positions.emplace_back(2.0 * i / (n - 1) - 1, 2.0 * j / (n - 1) - 1, 0);
  for (int j = 0; j + 1 < n; ++j)
    for (int i = 0; i + 1 < n; ++i) {
      const auto v = static_cast<std::uint32_t>(j * n + i), m = static_cast<std::uint32_t>(n);
      mesh.triangles.push_back({v, v + 1, v + m});
      mesh.triangles.push_back({v + 1, v + m + 1, v + m});
    }
  return mesh;
}

/// Seen from above, a little aside; `left_k` and `right_k` on the halves x < 0 and x > 0.
DifferencePicture from_above(double aside, float left_k, float right_k) {
  const Eigen::Vector3d eye(aside, 0.1, 3);
  Eigen::Matrix3d cam_from_world;  // looks down: x to the right, y of the image is -y of the world
  cam_from_world << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  const Eigen::Quaterniond q(cam_from_world);
  DifferencePicture p;
  p.view = {"view", Camera::from_fov(128, 96, 60), {q, -(q * eye)}};
  p.difference_k = cv::Mat(96, 128, CV_32F, cv::Scalar(none));
  p.only_here = cv::Mat::zeros(96, 128, CV_8U);
  p.only_there = cv::Mat::zeros(96, 128, CV_8U);
  const double middle = p.view.camera.project(p.view.cam_from_world * Eigen::Vector3d::Zero()).x();
  for (int y = 0; y < 96; ++y)
    for (int x = 0; x < 128; ++x) p.difference_k.at<float>(y, x) = x + 0.5 < middle ? left_k : right_k;
  return p;
}

std::vector<DifferencePicture> several(float left_k, float right_k) {
  std::vector<DifferencePicture> pictures;
  for (const double aside : {-0.4, -0.1, 0.2, 0.4})
    pictures.push_back(from_above(aside, left_k, right_k));
  return pictures;
}

TEST(SurfaceDifference, EachHalfHasItsOwn) {
  const TriangleMesh mesh = table();
  const auto found = surface_difference(mesh, several(5, -2), {}, {});
  ASSERT_TRUE(found);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double x = mesh.vertices.positions[v].x(), y = mesh.vertices.positions[v].y();
    // Beside an edge of the table, and where the halves meet, views count little or mix.
    if (std::abs(x) < 0.15 || std::abs(x) > 0.85 || std::abs(y) > 0.85) continue;
    ASSERT_EQ(found->change[v], SurfaceChange::same) << v;
    EXPECT_NEAR(found->difference_k[v], x < 0 ? 5 : -2, 1e-3);
    EXPECT_NEAR(found->spread_k[v], 0, 0.01);
  }
}

TEST(SurfaceDifference, ViewsThatDisagreeShowInTheSpread) {
  std::vector<DifferencePicture> pictures = several(1, 1);
  pictures[0].difference_k.setTo(3), pictures[2].difference_k.setTo(3);
  const auto found = surface_difference(table(), pictures, {}, {});
  ASSERT_TRUE(found);
  const std::size_t middle = 21 * 10 + 10;
  EXPECT_NEAR(found->difference_k[middle], 2, 0.2);
  EXPECT_NEAR(found->spread_k[middle], 1, 0.2);
}

TEST(SurfaceDifference, WhatTheOtherSawThroughIsChangedAndHasNoTemperature) {
  std::vector<DifferencePicture> pictures = several(1, 1);
  for (DifferencePicture& p : pictures) {
    p.difference_k.setTo(cv::Scalar(none));
    p.only_here.setTo(255);
  }
  const auto found = surface_difference(table(), pictures, {}, {});
  ASSERT_TRUE(found);
  const std::size_t middle = 21 * 10 + 10;
  EXPECT_EQ(found->change[middle], SurfaceChange::changed);
  EXPECT_TRUE(std::isnan(found->difference_k[middle]));
  // The other scene has nothing there: its own surface is not seen at all.
  const auto back = surface_difference(table(), seen_from_other(pictures, {}), {}, {});
  ASSERT_TRUE(back);
  EXPECT_EQ(back->change[middle], SurfaceChange::unseen);
}

TEST(SurfaceDifference, TheOtherSidesViewTurnsTheSign) {
  const auto swapped = seen_from_other(several(5, -2), {});
  EXPECT_EQ(swapped[0].difference_k.at<float>(48, 5), -5);
  Similarity3d world_from_other;
  world_from_other.scale = 2;
  world_from_other.translation = {1, 0, 0};
  const auto moved = seen_from_other(several(5, -2), world_from_other);
  const Eigen::Vector3d eye = camera_center(moved[0].view.cam_from_world);
  EXPECT_NEAR((world_from_other * eye - Eigen::Vector3d(-0.4, 0.1, 3)).norm(), 0, 1e-9);
}

TEST(SurfaceDifference, FewViewsSayNothing) {
  std::vector<DifferencePicture> pictures = several(5, 5);
  pictures.resize(2);
  for (const std::vector<DifferencePicture>& seen : {pictures, std::vector<DifferencePicture>()}) {
    const auto found = surface_difference(table(), seen, {}, {});
    ASSERT_TRUE(found);
    for (const SurfaceChange change : found->change) EXPECT_EQ(change, SurfaceChange::unseen);
  }
}

TEST(SurfaceDifference, OptionsAreChecked) {
  SurfaceDifferenceOptions options;
  options.changed_depth = options.same_depth / 2;
  EXPECT_EQ(surface_difference(table(), {}, options, {}).error().kind, ErrorKind::usage);
  EXPECT_EQ(difference_picture({}, {}, {}, {}, {}, {}).error().kind, ErrorKind::input);
}

}  // namespace
}  // namespace orbitfuse
