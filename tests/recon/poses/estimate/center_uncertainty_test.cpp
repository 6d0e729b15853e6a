// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/center_uncertainty.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/geometry/pose_error.hpp"
#include "core/geometry/scene_ball.hpp"
#include "recon/poses/sfm/bundle_adjustment.hpp"
#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

constexpr double noise_px = 0.8;

/// Two loops round points of which each view sees `share`; those of view 0 only `held` at most.
Reconstruction orbit(unsigned seed, std::size_t held) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_px);
  std::uniform_real_distribution<double> place(-0.6, 0.6), chance(0, 1);
  Reconstruction model;
  model.views = testing_orbit::two_loops();
  std::size_t of_first = 0;
  for (int p = 0; p < 400; ++p) {
    SparsePoint point;
    point.position = {place(random), place(random), place(random)};
    for (std::size_t v = 0; v < model.views.size(); ++v) {
      const PosedView& view = model.views[v];
      const Eigen::Vector3d x = view.cam_from_world * point.position;
      const Eigen::Vector2d pixel = view.camera.project(x);
      if (x.z() <= 0 || chance(random) > 0.3 || !(pixel.x() > 0 && pixel.y() > 0) ||
          pixel.x() > view.camera.width || pixel.y() > view.camera.height)
        continue;
      if (v == 0 && ++of_first > held) continue;
      point.track.push_back(
          {static_cast<int>(v), pixel + Eigen::Vector2d(noise(random), noise(random))});
    }
    if (point.track.size() >= 3) model.points.push_back(point);
  }
  return model;
}

double radius_of(const Reconstruction& model) {
  std::vector<Eigen::Vector3d> centers;
  for (const PosedView& v : model.views) centers.push_back(camera_center(v.cam_from_world));
  return rms_radius(centers);
}

TEST(CenterUncertainty, IsWhatBundleAdjustmentOfNoisyPixelsIsOffBy) {
  double off2 = 0, told2 = 0, first_off2 = 0, first_told2 = 0;
  constexpr int trials = 12;
  for (unsigned seed = 1; seed <= trials; ++seed) {
    Reconstruction model = orbit(seed, 14);
    const std::vector<PosedView> truth = model.views;
    const std::vector<double> told = center_uncertainty(model);
    ASSERT_EQ(told.size(), truth.size());
    BundleOptions options;
    options.loss_scale_px = options.max_error_px = 1000;  // noise alone, and all of it counts
    options.min_observations = 5;
    const LensGroup known{testing_orbit::camera().fx, 0, false, false};
    ASSERT_TRUE(adjust_bundle(model, std::vector<int>(truth.size(), 0), {known}, options));
    ASSERT_EQ(model.views.size(), truth.size());
    std::vector<PosePair> pairs;
    for (std::size_t v = 0; v < truth.size(); ++v)
      pairs.push_back({model.views[v].cam_from_world, truth[v].cam_from_world, truth[v].name});
    const auto aligned = truth_from_estimate(pairs);
    ASSERT_TRUE(aligned);
    for (std::size_t v = 0; v < truth.size(); ++v) {
      const double off = (*aligned * camera_center(pairs[v].cam_from_estimate) -
                          camera_center(pairs[v].cam_from_truth))
                             .norm() /
                         radius_of(model);
      (v == 0 ? first_off2 : off2) += off * off;
      (v == 0 ? first_told2 : told2) += told[v] * told[v];
    }
  }
  EXPECT_NEAR(std::sqrt(off2 / told2), 1, 0.15);
  EXPECT_NEAR(std::sqrt(first_off2 / first_told2), 1, 0.4);
  EXPECT_GT(first_told2 / trials, 4 * told2 / trials / 23);
}

TEST(CenterUncertainty, NeitherUnitNorPlaceOfTheWorldChangesIt) {
  const Reconstruction model = orbit(3, 100);
  const std::vector<double> here = center_uncertainty(model);
  const Similarity3d moved_from_world{
      1e6,
      Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d(1, -2, 3).normalized())),
      {5e7, -3e7, 1e6}};
  Reconstruction moved = model;
  for (PosedView& v : moved.views) v.cam_from_world = rebase(v.cam_from_world, moved_from_world);
  for (SparsePoint& p : moved.points) p.position = moved_from_world * p.position;
  const std::vector<double> there = center_uncertainty(moved);
  ASSERT_EQ(there.size(), here.size());
  for (std::size_t v = 0; v < here.size(); ++v) EXPECT_NEAR(there[v] / here[v], 1, 1e-3);
}

TEST(CenterUncertainty, WhatNothingHoldsIsInfinitelyUncertain) {
  Reconstruction model = orbit(4, 0);
  const std::vector<double> sigmas = center_uncertainty(model);
  EXPECT_TRUE(std::isinf(sigmas[0]));
  EXPECT_LT(sigmas[1], 0.1);
  model.points.clear();
  for (const double sigma : center_uncertainty(model)) EXPECT_TRUE(std::isinf(sigma));
  model.views.resize(2);
  EXPECT_TRUE(center_uncertainty(model).empty());
}

TEST(CenterUncertainty, PointsThatAreNoneCountForNothing) {
  const Reconstruction model = orbit(5, 100);
  Reconstruction spoilt = model;
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    SparsePoint point = spoilt.points.front();
    point.position = {bad, 0, 0};
    spoilt.points.push_back(point);
  }
  SparsePoint behind = spoilt.points.front();
  behind.track.resize(1);
  spoilt.points.push_back(behind);
  const std::vector<double> clean = center_uncertainty(model), dirty = center_uncertainty(spoilt);
  for (std::size_t v = 0; v < clean.size(); ++v) {
    ASSERT_TRUE(std::isfinite(dirty[v])) << v;
    EXPECT_NEAR(dirty[v] / clean[v], 1, 1e-9);
  }
  spoilt.points.back() = model.points.front();
  spoilt.points.back().position = {1e300, 0, 0};
  for (const double sigma : center_uncertainty(spoilt)) EXPECT_GT(sigma, 0);
  for (PosedView& view : spoilt.views) view.cam_from_world.translation.setZero();
  for (const double sigma : center_uncertainty(spoilt)) EXPECT_TRUE(std::isinf(sigma));
}

}  // namespace
}  // namespace orbitfuse
