// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "recon/nerf/training/scene.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int side = 64;
constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
constexpr float sky = std::numeric_limits<float>::infinity();

/// A ring of cameras of 90 degrees, level, which look at the centre from a distance of 1.
std::vector<NormalisedView> ring(int count, float distance) {
  std::vector<NormalisedView> views;
  for (int i = 0; i < count; ++i) {
    const double azimuth = 2 * std::numbers::pi * i / count;
    const Eigen::Vector3d eye(std::cos(azimuth), std::sin(azimuth), 0);
    Eigen::Matrix3d axes;
    axes.col(2) = -eye;
    axes.col(0) = axes.col(2).cross(Eigen::Vector3d::UnitZ());
    axes.col(1) = axes.col(2).cross(axes.col(0));
    Rigid3d pose;
    pose.rotation = Eigen::Quaterniond(axes.transpose());
    pose.translation = -(axes.transpose() * eye);
    NormalisedView view;
    view.rays = ViewRays(Camera::from_fov(side, side, 90), pose, {});
    view.distance = cv::Mat(side, side, CV_32FC1, cv::Scalar(distance));
    views.push_back(view);
  }
  return views;
}

Occupancy carved(const std::vector<NormalisedView>& views) {
  Occupancy occupancy;
  occupancy.create(64, 3);
  TrainOptions options;
  options.min_views = 1;
  carve(true, views, std::vector<bool>(views.size()), options, occupancy);
  return occupancy;
}

bool allowed(const Occupancy& occupancy, float x, float y, float z) {
  const float at[3] = {x, y, z};
  return Occupancy::test(occupancy.allowed, occupancy.cell_of(Occupancy::cascade_of(at), at));
}

TEST(Carve, OpenSkyEmptiesWhatStandsBeyondTheCameras) {
  const Occupancy occupancy = carved(ring(8, sky));
  EXPECT_FALSE(allowed(occupancy, 2.5f, 0, 0.3f));
  EXPECT_FALSE(allowed(occupancy, -2, 2, -0.3f));
  // A white roof before a white sky shows no edge.
  EXPECT_TRUE(allowed(occupancy, 0, 0, 0.2f));
  EXPECT_TRUE(allowed(occupancy, 0.8f, 0.3f, 0.1f));
}

TEST(Carve, UnknownDepthEmptiesNothing) {
  const Occupancy occupancy = carved(ring(8, unknown));
  EXPECT_TRUE(allowed(occupancy, 2.5f, 0, 0.3f));
  EXPECT_TRUE(allowed(occupancy, 0, 0, 0.2f));
}

TEST(Carve, WhatAViewSeesThroughIsEmptyUnlessOthersKnowASurfaceThere) {
  std::vector<NormalisedView> views = ring(8, unknown);
  views[4].distance.setTo(sky);
  EXPECT_FALSE(allowed(carved(views), 2.5f, 0, 0.3f));
  views[3].distance.setTo(3.4f);
  EXPECT_TRUE(allowed(carved(views), 2.5f, 0, 0.3f));
}

TEST(KnownDepth, IsWhatHasASurface) {
  Dataset data;
  DepthMap map;
  map.depth = cv::Mat(2, 2, CV_32FC1, cv::Scalar(sky));
  data.depth.push_back(map);
  EXPECT_EQ(data.known_depth(), 0);
  EXPECT_FALSE(data.has_dense_depth());
  data.depth[0].depth.at<float>(0, 0) = 1;
  data.depth[0].depth.at<float>(0, 1) = unknown;
  EXPECT_DOUBLE_EQ(data.known_depth(), 0.25);
}

}  // namespace
}  // namespace orbitfuse::nerf
