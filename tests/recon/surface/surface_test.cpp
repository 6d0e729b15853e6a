// SPDX-License-Identifier: BSD-3-Clause
#include "recon/surface/surface.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orbitfuse {
namespace {
using ::testing::HasSubstr;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr double sphere_radius = 0.3;

/// Looks at the origin from `eye`, up being z.
PosedView looking(const Eigen::Vector3d& eye, int width = 160) {
  const Eigen::Vector3d z = -eye.normalized(), x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d cam_from_world;
  cam_from_world << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond q(cam_from_world);
  return {"view", Camera::from_fov(width, width * 3 / 4, 50), {q, -(q * eye)}};
}

cv::Mat depth_of_sphere(const PosedView& view) {
  cv::Mat depth(view.camera.height, view.camera.width, CV_32FC1, cv::Scalar(nan));
  const Eigen::Vector3d center = view.cam_from_world * Eigen::Vector3d::Zero();
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      const Eigen::Vector3d ray = view.camera.ray_of({x + 0.5, y + 0.5});
      const double a = ray.squaredNorm(), b = ray.dot(center),
                   c = center.squaredNorm() - sphere_radius * sphere_radius;
      if (b * b - a * c >= 0)
        depth.at<float>(y, x) = static_cast<float>((b - std::sqrt(b * b - a * c)) / a);
    }
  return depth;
}

std::vector<SurfaceView> round_the_sphere() {
  std::vector<SurfaceView> views;
  for (int i = 0; i < 24; ++i) {
    const double azimuth = i * 0.5236, elevation = i < 12 ? 0.9 : -0.7;
    const PosedView view = looking({std::cos(azimuth) * std::cos(elevation),
                                    std::sin(azimuth) * std::cos(elevation), std::sin(elevation)});
    views.push_back({view, depth_of_sphere(view)});
  }
  return views;
}

Eigen::AlignedBox3d cube(double half) {
  return {Eigen::Vector3d::Constant(-half), Eigen::Vector3d::Constant(half)};
}

SurfaceOptions coarse() {
  SurfaceOptions options;
  options.resolution = 64;
  return options;
}

TEST(Surface, SphereComesOutClosedRoundAndOutside) {
  const auto mesh = fuse_depth(round_the_sphere(), cube(0.4), coarse(), {});
  ASSERT_TRUE(mesh) << mesh.error().message();
  const double voxel = 0.8 / 64;
  for (const Eigen::Vector3d& p : mesh->vertices.positions)
    ASSERT_NEAR(p.norm(), sphere_radius, 0.35 * voxel);
  double volume = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh->triangles) {
    const auto& p = mesh->vertices.positions;
    volume += p[t[0]].dot(p[t[1]].cross(p[t[2]])) / 6;
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  EXPECT_NEAR(volume, 4.18879 * std::pow(sphere_radius, 3), 0.003);  // positive: faces outwards
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1);
    ASSERT_TRUE(edges.contains({edge.second, edge.first}));
  }
}

TEST(Surface, SameForAnyBoxOriginAndScaleOfTheWorld) {
  auto views = round_the_sphere();
  const Similarity3d moved{
      1000, Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitY())), {5e4, 0, -3e4}};
  for (SurfaceView& s : views) {
    s.view.cam_from_world = rebase(s.view.cam_from_world, moved);
    s.depth *= moved.scale;
  }
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(400);
  const auto mesh =
      fuse_depth(views, {moved.translation - half, moved.translation + half}, coarse(), {});
  ASSERT_TRUE(mesh) << mesh.error().message();
  for (const Eigen::Vector3d& p : mesh->vertices.positions)
    ASSERT_NEAR((p - moved.translation).norm(), 300, 5);
}

TEST(Surface, WhatViewsSeeThroughIsNotThere) {
  auto views = round_the_sphere();
  // One view claims a board before the sphere; the others see through it.
  views[3].depth(cv::Rect(70, 50, 20, 20)).setTo(0.62F);
  const auto mesh = fuse_depth(views, cube(0.4), coarse(), {});
  ASSERT_TRUE(mesh);
  const TriangleMesh clean = without_small_pieces(*mesh, 0.2);
  std::size_t off = 0;
  for (const Eigen::Vector3d& p : clean.vertices.positions)
    off += std::abs(p.norm() - sphere_radius) > 0.02;
  EXPECT_LT(static_cast<double>(off), 0.01 * static_cast<double>(clean.vertices.size()));
}

TEST(Surface, NothingToSeeIsNamed) {
  for (const float depth : {nan, std::numeric_limits<float>::infinity(), 0.0F, -1.0F, 1e30F}) {
    auto views = round_the_sphere();
    for (SurfaceView& s : views) s.depth.setTo(depth);
    const auto mesh = fuse_depth(views, cube(0.4), coarse(), {});
    ASSERT_FALSE(mesh) << depth;
    EXPECT_EQ(mesh.error().kind, ErrorKind::quality);
  }
  EXPECT_EQ(fuse_depth({}, cube(0.4), coarse(), {}).error().kind, ErrorKind::quality);
}

TEST(Surface, OneViewGivesItsOwnSide) {
  const auto all = round_the_sphere();
  const auto mesh = fuse_depth({all[0]}, cube(0.4), coarse(), {});
  ASSERT_TRUE(mesh) << mesh.error().message();
  for (const Eigen::Vector3d& p : mesh->vertices.positions)
    ASSERT_GT(p.dot(camera_center(all[0].view.cam_from_world)), 0);
}

TEST(Surface, BadBoxesMapsAndPosesAreNamed) {
  const auto views = round_the_sphere();
  Eigen::AlignedBox3d flat = cube(0.4);
  flat.max().x() = flat.min().x();
  Eigen::AlignedBox3d endless = cube(0.4);
  endless.max().x() = std::numeric_limits<double>::infinity();
  for (const Eigen::AlignedBox3d& box :
       {flat, endless, Eigen::AlignedBox3d(), cube(std::nan("")), cube(1e300)}) {
    const auto mesh = fuse_depth(views, box, coarse(), {});
    ASSERT_FALSE(mesh);
    EXPECT_THAT(mesh.error().message(), HasSubstr("box"));
  }
  auto small = views;
  small[2].depth = cv::Mat(4, 4, CV_32FC1, cv::Scalar(1));
  EXPECT_EQ(fuse_depth(small, cube(0.4), coarse(), {}).error().kind, ErrorKind::input);
  auto lost = views;
  lost[2].view.cam_from_world.translation.x() = std::nan("");
  EXPECT_EQ(fuse_depth(lost, cube(0.4), coarse(), {}).error().kind, ErrorKind::input);
  SurfaceOptions none = coarse();
  none.resolution = 0;
  EXPECT_THAT(fuse_depth(views, cube(0.4), none, {}).error().message(),
              HasSubstr("surface.resolution"));
}

TEST(Surface, SimplifiedKeepsItsForm) {
  const auto mesh = fuse_depth(round_the_sphere(), cube(0.4), coarse(), {});
  ASSERT_TRUE(mesh);
  TriangleMesh painted = *mesh;
  for (const Eigen::Vector3d& p : painted.vertices.positions)
    painted.vertices.temperatures_k.push_back(static_cast<float>(p.z()));
  const TriangleMesh few = simplified(painted, 2000);
  EXPECT_LE(few.triangles.size(), 2000U);
  EXPECT_GT(few.triangles.size(), 1500U);
  for (const Eigen::Vector3d& p : few.vertices.positions)
    ASSERT_NEAR(p.norm(), sphere_radius, 0.005);
  ASSERT_EQ(few.vertices.temperatures_k.size(), few.vertices.size());
  for (std::size_t i = 0; i < few.vertices.size(); ++i)
    ASSERT_EQ(few.vertices.temperatures_k[i], static_cast<float>(few.vertices.positions[i].z()));
  EXPECT_EQ(simplified(few, 1'000'000).triangles.size(), few.triangles.size());
  EXPECT_TRUE(simplified({}, 10).empty());
}

TriangleMesh triangle_at(double x, double size) {
  TriangleMesh mesh;
  mesh.vertices.positions = {{x, 0, 0}, {x + size, 0, 0}, {x, size, 0}};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

TEST(Surface, SmallPiecesAndBrokenTrianglesGo) {
  TriangleMesh mesh = triangle_at(0, 1);
  const TriangleMesh small = triangle_at(5, 0.1);
  for (const Eigen::Vector3d& p : small.vertices.positions) mesh.vertices.positions.push_back(p);
  mesh.vertices.positions.emplace_back(std::nan(""), 0, 0);
  mesh.triangles.push_back({3, 4, 5});
  mesh.triangles.push_back({0, 1, 6});
  mesh.triangles.push_back({0, 0, 1});
  mesh.vertices.temperatures_k = {1, 2, 3, 4, 5, 6, 7};
  const TriangleMesh clean = without_small_pieces(mesh, 0.5);
  EXPECT_EQ(clean.triangles.size(), 1U);
  EXPECT_EQ(clean.vertices.temperatures_k, (std::vector<float>{1, 2, 3}));
  EXPECT_TRUE(without_small_pieces({}, 1).empty());
  EXPECT_TRUE(without_small_pieces(mesh, 10).empty());
}

TEST(MeshDepth, IsThatOfTheTriangle) {
  const PosedView view = looking({0, -2, 0});
  TriangleMesh mesh;
  mesh.vertices.positions = {{-1, 0.5, -1}, {1, 0.5, -1}, {0, 0.5, 1.5}, {0, -3, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}};  // the second reaches behind the camera: left out
  const cv::Mat depth = mesh_depth(mesh, view);
  EXPECT_NEAR(depth.at<float>(depth.rows / 2, depth.cols / 2), 2.5, 1e-5);
  EXPECT_TRUE(std::isnan(depth.at<float>(0, 0)));
  mesh.vertices.positions[0].x() = std::nan("");
  EXPECT_EQ(cv::countNonZero(mesh_depth(mesh, view) == mesh_depth(mesh, view)), 0);
  EXPECT_EQ(cv::countNonZero(mesh_depth({}, view) == mesh_depth({}, view)), 0);
}

TEST(Paint, EachSideTakesTheColourOfWhoSeesIt) {
  const auto views = round_the_sphere();
  const auto mesh = fuse_depth(views, cube(0.4), coarse(), {});
  ASSERT_TRUE(mesh);
  // Two cameras, on opposite sides: 300 K and 310 K.
  std::vector<PaintView> pictures;
  for (const double side : {1.0, -1.0}) {
    const PosedView view = looking({side, 0, 0});
    pictures.push_back({view, cv::Mat(view.camera.height, view.camera.width, CV_32FC1,
                                      cv::Scalar(side > 0 ? 300 : 310))});
  }
  const auto painted = paint(*mesh, pictures, 80, {});
  ASSERT_TRUE(painted);
  int seen = 0, unseen = 0;
  for (std::size_t i = 0; i < painted->values.size(); ++i) {
    const double x = mesh->vertices.positions[i].x();
    const float value = painted->values[i][0];
    if (std::abs(x) > 0.16) {
      ASSERT_NEAR(value, x > 0 ? 300 : 310, 1e-3) << x;
      ++seen;
    } else if (std::abs(x) < 0.05) {  // hidden behind the sphere's limb from both
      ASSERT_TRUE(std::isnan(value)) << x;
      ASSERT_EQ(painted->views[i], 0);
      ++unseen;
    }
  }
  EXPECT_GT(seen, 100);
  EXPECT_GT(unseen, 100);
}

TEST(Paint, NanAndBadPicturesPaintNothing) {
  const TriangleMesh mesh = triangle_at(0, 0.1);
  const PosedView view = looking({0, -1, 1});
  cv::Mat unknown(view.camera.height, view.camera.width, CV_32FC1, cv::Scalar(nan));
  const auto painted = paint(mesh, {{view, unknown}}, 80, {});
  ASSERT_TRUE(painted);
  for (const cv::Vec3f& v : painted->values) EXPECT_TRUE(std::isnan(v[0]));
  EXPECT_TRUE(paint({}, {{view, unknown}}, 80, {})->values.empty());
  EXPECT_TRUE(std::isnan(paint(mesh, {}, 80, {})->values[0][0]));
  EXPECT_EQ(paint(mesh, {{view, cv::Mat(3, 3, CV_32FC1)}}, 80, {}).error().kind, ErrorKind::input);
}

}  // namespace
}  // namespace orbitfuse
