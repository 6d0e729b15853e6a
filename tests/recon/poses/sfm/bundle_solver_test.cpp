// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/bundle_solver.hpp"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "core/system/parallel.hpp"
#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

constexpr double loss_px = 1;
const Intrinsics bent_lens{610, 605, 322, 238, -0.08, 0.02, 0.0004, -0.0003};

LensBelief belief() {
  LensBelief belief;
  belief.mean = {600, 600, 320, 240, 0, 0, 0, 0};
  belief.sigma = {30, 1, 7, 7, 0.1, 0.1, 0.0005, 0.0005};
  return belief;
}

/// Noisy sightings of a cube with false ones among them, and a start a little off the truth.
struct Scene {
  BundleSolver::State start;
  std::vector<SeenPoint> seen;
  std::size_t far = 0;  ///< the view farthest from the first

  explicit Scene(const std::vector<PosedView>& views, int points, double wrong_share = 0.05) {
    std::mt19937 rng(11);
    std::normal_distribution<double> normal;
    const Reconstruction cube = testing_orbit::seen_cube(views, points, 0);
    for (const PosedView& view : views) {
      const Eigen::Vector3d turn = 0.004 * Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
      const bool first = start.rotation.empty();
      const Eigen::Quaterniond& q = view.cam_from_world.rotation;
      start.rotation.push_back(first ? q : Eigen::AngleAxisd(turn.norm(), turn.normalized()) * q);
      start.center.push_back(camera_center(view.cam_from_world));
      if ((start.center.back() - start.center[0]).norm() >
          (start.center[far] - start.center[0]).norm())
        far = start.center.size() - 1;
    }
    for (std::size_t v = 1; v < start.center.size(); ++v)
      if (v != far)
        start.center[v] += 0.02 * Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
    start.lens = {{600, 600, 320, 240, 0, 0, 0, 0}};
    for (const SparsePoint& point : cube.points) {
      for (const Observation& o : point.track) {
        const PosedView& view = views[static_cast<std::size_t>(o.view)];
        const Eigen::Vector3d x = view.cam_from_world * point.position;
        Eigen::Vector2d pixel = project<double>(x, bent_lens.data());
        pixel += 0.3 * Eigen::Vector2d(normal(rng), normal(rng));
        if (normal(rng) < -2 && wrong_share > 0) pixel += Eigen::Vector2d(25, -40);
        seen.push_back({o.view, static_cast<int>(start.point.size()), pixel});
      }
      start.point.push_back(point.position +
                            0.02 * Eigen::Vector3d(normal(rng), normal(rng), normal(rng)));
    }
  }

  BundleSolver solver(std::size_t dense_up_to = 400) const {
    BundleSolver made(start, std::vector<int>(start.center.size(), 0), {belief()}, seen, loss_px,
                      dense_up_to);
    made.hold_rotation(0);
    for (int axis = 0; axis < 3; ++axis) made.hold_center(0, axis), made.hold_center(far, axis);
    return made;
  }
};

struct CeresSeen {
  SeenPoint seen;
  template <class T>
  bool operator()(const T* rotation, const T* center, const T* lens, const T* point,
                  T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(rotation);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> c(center), x(point);
    const Eigen::Matrix<T, 3, 1> in_cam = q * (x - c);
    const Eigen::Matrix<T, 2, 1> p = project(in_cam, lens);
    residual[0] = (p.x() - T(seen.pixel.x())) / T(seen.unit_px);
    residual[1] = (p.y() - T(seen.pixel.y())) / T(seen.unit_px);
    return true;
  }
};

struct CeresBelief {
  LensBelief belief;
  template <class T>
  bool operator()(const T* lens, T* residual) const {
    for (int i = 0; i < 8; ++i) {
      const auto k = static_cast<std::size_t>(i);
      residual[i] = (lens[i] - T(belief.mean[k])) / T(belief.sigma[k]);
    }
    residual[1] = (lens[1] / lens[0] - T(belief.mean[1] / belief.mean[0])) / T(belief.aspect_sigma);
    return true;
  }
};

/// What Ceres finds, and its focal length's standard deviation.
std::pair<BundleSolver::State, double> by_ceres(const Scene& scene) {
  BundleSolver::State at = scene.start;
  ceres::Problem problem;
  for (const SeenPoint& seen : scene.seen) {
    const auto v = static_cast<std::size_t>(seen.view);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<CeresSeen, 2, 4, 3, 8, 3>(new CeresSeen{seen}),
        new ceres::CauchyLoss(loss_px), at.rotation[v].coeffs().data(), at.center[v].data(),
        at.lens[0].data(), at.point[static_cast<std::size_t>(seen.point)].data());
  }
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<CeresBelief, 8, 8>(new CeresBelief{belief()}), nullptr,
      at.lens[0].data());
  for (Eigen::Quaterniond& q : at.rotation)
    problem.SetManifold(q.coeffs().data(), new ceres::EigenQuaternionManifold);
  problem.SetParameterBlockConstant(at.rotation[0].coeffs().data());
  problem.SetParameterBlockConstant(at.center[0].data());
  problem.SetParameterBlockConstant(at.center[scene.far].data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-14;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  ceres::Covariance covariance({});
  const std::vector<std::pair<const double*, const double*>> wanted = {
      {at.lens[0].data(), at.lens[0].data()}};
  EXPECT_TRUE(covariance.Compute(wanted, &problem));
  std::array<double, 64> block{};
  covariance.GetCovarianceBlock(at.lens[0].data(), at.lens[0].data(), block.data());
  return {at, std::sqrt(block[0])};
}

TEST(BundleSolver, FindsWhatCeresFinds) {
  Scene scene(testing_orbit::two_loops(), 120);
  for (SeenPoint& seen : scene.seen) seen.unit_px = seen.view % 3 == 0 ? 2 : 1;
  const auto [wanted, focal_sigma] = by_ceres(scene);
  BundleSolver solver = scene.solver();
  ASSERT_TRUE(solver.solve(200, 1e-14).usable);
  const BundleSolver::State& found = solver.state();
  for (std::size_t v = 0; v < wanted.center.size(); ++v) {
    EXPECT_LT((found.center[v] - wanted.center[v]).norm(), 1e-5) << v;
    EXPECT_LT(found.rotation[v].angularDistance(wanted.rotation[v]), 1e-5) << v;
  }
  for (std::size_t k = 0; k < 8; ++k)
    EXPECT_NEAR(found.lens[0][k], wanted.lens[0][k], 1e-5 * (1 + std::abs(wanted.lens[0][k])));
  for (std::size_t p = 0; p < wanted.point.size(); ++p)
    EXPECT_LT((found.point[p] - wanted.point[p]).norm(), 1e-4) << p;
  EXPECT_NEAR(found.lens[0][0], bent_lens[0], 3);
  ASSERT_TRUE(solver.focal_sigmas()[0]);
  EXPECT_NEAR(*solver.focal_sigmas()[0], focal_sigma, 0.02 * focal_sigma);
}

TEST(BundleSolver, TheSameBitsForAnyNumberOfThreads) {
  const Scene scene(testing_orbit::two_loops(), 60);
  const int before = thread_count();
  std::vector<BundleSolver::State> found;
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    BundleSolver solver = scene.solver();
    solver.solve(30, 1e-10);
    found.push_back(solver.state());
  }
  set_thread_count(before);
  EXPECT_EQ(found[0].lens, found[1].lens);
  for (std::size_t v = 0; v < found[0].center.size(); ++v) {
    EXPECT_EQ(found[0].center[v], found[1].center[v]);
    EXPECT_EQ(found[0].rotation[v].coeffs(), found[1].rotation[v].coeffs());
  }
}

TEST(BundleSolver, SparseAndDenseEquationsHaveOneAnswer) {
  std::vector<PosedView> views;
  constexpr int count = 60, side = 8;
  for (int i = 0; i < count; ++i) {
    OrbitPose pose;
    pose.azimuth_deg = 360.0 * i / count, pose.elevation_deg = i % 2 == 0 ? 14 : 34;
    pose.radius = 4;
    const Camera camera = testing_orbit::camera();
    views.push_back({std::to_string(i), camera, cam_from_world_of(pose, camera)});
  }
  Scene scene(views, 300, 0);
  // A point is seen by those of one side alone, so that few pairs of views see one.
  std::erase_if(scene.seen, [](const SeenPoint& seen) {
    return (seen.view + 7 * count - 7 * seen.point % count) % count >= side;
  });
  BundleSolver dense = scene.solver(count), sparse = scene.solver(0);
  ASSERT_TRUE(dense.solve(100, 1e-14).usable);
  ASSERT_TRUE(sparse.solve(100, 1e-14).usable);
  double moved = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    EXPECT_LT((dense.state().center[v] - sparse.state().center[v]).norm(), 1e-6) << v;
    moved = std::max(moved, (dense.state().center[v] - scene.start.center[v]).norm());
  }
  EXPECT_GT(moved, 0.01);
  EXPECT_NEAR(*dense.focal_sigmas()[0], *sparse.focal_sigmas()[0], 1e-6);
}

TEST(BundleSolver, TwoLensesAndAPointThatNobodySees) {
  Scene scene(testing_orbit::two_loops(), 120, 0);
  std::vector<int> lens_of(24, 0);
  for (std::size_t v = 12; v < 24; ++v) lens_of[v] = 1;
  scene.start.lens.push_back(scene.start.lens[0]);
  scene.start.point.insert(scene.start.point.begin() + 5, Eigen::Vector3d(0.1, 0.2, 0.3));
  for (SeenPoint& seen : scene.seen) seen.point += seen.point >= 5 ? 1 : 0;
  LensBelief straight = belief();  // of the second: only its focal length is free
  for (std::size_t k = 2; k < 8; ++k) straight.held[k] = true;
  BundleSolver solver(scene.start, lens_of, {belief(), straight}, scene.seen, loss_px);
  ASSERT_TRUE(solver.solve(100, 1e-12).usable);
  EXPECT_NEAR(solver.state().lens[0][0], bent_lens[0], 6);
  EXPECT_NE(solver.state().lens[1][0], scene.start.lens[1][0]);
  for (std::size_t k = 2; k < 8; ++k)
    EXPECT_EQ(solver.state().lens[1][k], scene.start.lens[1][k]) << k;
  EXPECT_EQ(solver.state().point[5], scene.start.point[5]);
  EXPECT_FALSE(solver.focal_sigmas()[0]) << "nothing holds the world: the equations are singular";
  solver.hold_rotation(0);
  for (int axis = 0; axis < 3; ++axis)
    solver.hold_center(0, axis), solver.hold_center(scene.far, axis);
  EXPECT_TRUE(solver.focal_sigmas()[0] && solver.focal_sigmas()[1]);
}

TEST(BundleSolver, AHeldValueThatIsNotItsMeanDrownsNothing) {
  Scene scene(testing_orbit::two_loops(), 120, 0);
  LensBelief exact = belief();
  exact.held[0] = exact.held[1] = true;
  exact.mean[0] = exact.mean[1] = 500, exact.sigma[0] = 1e-7;
  BundleSolver solver(scene.start, std::vector<int>(24, 0), {exact}, scene.seen, loss_px);
  solver.hold_rotation(0);
  for (int axis = 0; axis < 3; ++axis)
    solver.hold_center(0, axis), solver.hold_center(scene.far, axis);
  ASSERT_TRUE(solver.solve(60, 1e-8).usable);
  EXPECT_EQ(solver.state().lens[0][0], 600);
  EXPECT_NE(solver.state().lens[0][4], 0) << "its distortion is free";
  EXPECT_LT(solver.state().lens[0][4], -0.04);
}

TEST(BundleSolver, WhatIsHeldStays) {
  const Scene scene(testing_orbit::two_loops(), 60);
  LensBelief held = belief();
  held.held.fill(true);
  BundleSolver solver(scene.start, std::vector<int>(24, 0), {held}, scene.seen, loss_px);
  for (std::size_t v = 0; v < 24; ++v) {
    solver.hold_rotation(v);
    for (int axis = 0; axis < 3; ++axis) solver.hold_center(v, axis);
  }
  ASSERT_TRUE(solver.solve(30, 1e-8).usable);
  EXPECT_EQ(solver.state().lens, scene.start.lens);
  for (std::size_t v = 0; v < 24; ++v)
    EXPECT_EQ(solver.state().center[v], scene.start.center[v]) << v;
  EXPECT_FALSE(solver.focal_sigmas()[0]);
}

TEST(BundleSolver, WhatMakesNoSenseIsNoAnswer) {
  Scene scene(testing_orbit::two_loops(), 30);
  scene.start.point[0] = 20 * scene.start.center[0];  // behind one camera
  BundleSolver behind = scene.solver();
  EXPECT_TRUE(behind.solve(30, 1e-8).usable);
  for (const Eigen::Vector3d& center : behind.state().center) EXPECT_TRUE(center.allFinite());
  scene.seen[5].pixel.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(scene.solver().solve(30, 1e-8).usable);
  Scene nothing(testing_orbit::two_loops(), 30);
  nothing.seen.clear();
  EXPECT_TRUE(nothing.solver().solve(30, 1e-8).usable);
}

}  // namespace
}  // namespace orbitfuse
