// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/pose_bundle.hpp"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "core/system/parallel.hpp"
#include "recon/alignment/patch_residual.hpp"

namespace orbitfuse {
namespace {

Camera small_camera() {
  Camera c;
  c.width = 320, c.height = 240;
  c.fx = c.fy = 300, c.cx = 160, c.cy = 120;
  return c;
}

/// Cameras on an arc round the origin, places near it, and what is wrong with poses and lens.
struct Scene {
  std::vector<Rigid3d> guessed;
  std::vector<PoseCorrection> errors;  ///< true pose = rigid_of(error) * guessed
  double log_focal = 0.02, radial = -0.05;
  std::mt19937 rng{7};
  std::uniform_real_distribution<double> any{-1, 1};

  explicit Scene(std::size_t views) {
    for (std::size_t i = 0; i < views; ++i) {
      const double azimuth = 0.3 * static_cast<double>(i);
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(azimuth, Eigen::Vector3d::UnitY()));
      guessed.push_back({turn, {0, 0, 3}});
      errors.emplace_back();
      for (double& value : errors.back()) value = 0.03 * any(rng);
    }
  }

  Eigen::Vector3d place() { return {0.8 * any(rng), 0.8 * any(rng), 0.8 * any(rng)}; }

  /// Where the true camera sees a place.
  Eigen::Vector2d seen(std::size_t view, const Eigen::Vector3d& world) const {
    return corrected_pixel(small_camera(), CorrectedPose(errors[view]), log_focal, radial,
                           guessed[view] * world)
        ->pixel;
  }

  PatchMatch match(std::size_t view) {
    const Eigen::Vector3d world = place();
    Eigen::Matrix2d weight;
    weight << 1, 0.2, 0.2, 0.7;
    return {guessed[view] * world, seen(view, world), weight, 0.8};
  }

  SharedPlace shared(double off_surface) {
    const Eigen::Vector3d surface = place();
    SharedPlace out{(surface - guessed[0].inverse().translation).normalized(), 0.05, {}};
    const Eigen::Vector3d world = surface + off_surface * out.sight;
    for (std::size_t v = 0; v < guessed.size(); ++v)
      out.sightings.push_back({v, guessed[v] * surface, guessed[v].rotation.toRotationMatrix(),
                               seen(v, world), Eigen::Matrix2d::Identity()});
    return out;
  }
};

constexpr CommonLensPrior free_lens{{0, 0.1}, {0, 0.5}};

TEST(PoseBundle, FindsCorrectionsAndLensOfExactPatches) {
  Scene scene(3);
  PoseBundle bundle(small_camera(), 3);
  for (std::size_t v = 0; v < 3; ++v)
    for (int i = 0; i < 60; ++i) bundle.add(v, scene.match(v), 0.8);
  for (const double loss_px : {8.0, 1.0})
    ASSERT_TRUE(bundle.solve({{0.02, 1}, {-0.05, 1}}, {loss_px, 1}, 50));
  EXPECT_NEAR(bundle.log_focal(), scene.log_focal, 1e-6);
  EXPECT_NEAR(bundle.radial(), scene.radial, 1e-5);
  for (std::size_t v = 0; v < 3; ++v)
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_NEAR(bundle.corrections()[v][k], scene.errors[v][k], 1e-6) << v << ", " << k;
}

TEST(PoseBundle, SharedPlacesLeaveTheSurface) {
  Scene scene(4);
  PoseBundle bundle(small_camera(), 4);
  for (std::size_t v = 0; v < 4; ++v)
    for (int i = 0; i < 30; ++i) bundle.add(v, scene.match(v), 1);
  for (int i = 0; i < 80; ++i) bundle.add(scene.shared(0.02));
  ASSERT_TRUE(bundle.solve(free_lens, {1, 2}, 100));
  ASSERT_TRUE(bundle.solve(free_lens, {1, 0.5}, 100));
  for (const auto& place : bundle.sighting_residuals_px())
    for (const double residual : place) EXPECT_LT(residual, 0.3);
  EXPECT_NEAR(bundle.log_focal(), scene.log_focal, 3e-3);  // the surface holds a little
}

TEST(PoseBundle, HeldViewsStayAndHoldTheOthers) {
  Scene scene(4);
  PoseBundle bundle(small_camera(), 4);
  scene.log_focal = scene.radial = 0;
  for (const std::size_t v : {0u, 1u, 2u}) {
    scene.errors[v] = {};
    bundle.hold(v);
  }
  for (int i = 0; i < 80; ++i) bundle.add(scene.shared(0));
  for (const double loss_px : {8.0, 1.0}) ASSERT_TRUE(bundle.solve({}, {1, loss_px}, 50));
  for (const std::size_t v : {0u, 1u, 2u})
    for (const double value : bundle.corrections()[v]) EXPECT_EQ(value, 0) << v;
  for (std::size_t k = 0; k < 6; ++k)
    EXPECT_NEAR(bundle.corrections()[3][k], scene.errors[3][k], 1e-5) << k;
  EXPECT_EQ(bundle.log_focal(), 0);
}

/// The same cost by Ceres: sightings' numeric derivatives, no formula of ours but the projection.
struct Sighting {
  Camera camera;
  SharedPlace::Sighting seen;
  bool operator()(const double* correction, const double* lens, const double* offset,
                  double* residual) const {
    const Eigen::Vector3d point =
        seen.point + seen.cam_from_world * Eigen::Map<const Eigen::Vector3d>(offset);
    const auto pixel = corrected_pixel(camera, CorrectedPose(correction), lens[0], lens[1], point);
    if (!pixel) return false;
    Eigen::Map<Eigen::Vector2d> out(residual);
    out = seen.sqrt_weight * (pixel->pixel - seen.pixel);
    return true;
  }
};
struct Hold {
  Eigen::Vector3d sight;
  double sigma;
  bool operator()(const double* offset, double* residual) const {
    residual[0] = Eigen::Map<const Eigen::Vector3d>(offset).dot(sight) / sigma;
    return true;
  }
};
struct Near {
  CommonLensPrior prior;
  bool operator()(const double* lens, double* residual) const {
    residual[0] = (lens[0] - prior.log_focal.mean) / prior.log_focal.sigma;
    residual[1] = (lens[1] - prior.radial.mean) / prior.radial.sigma;
    return true;
  }
};

TEST(PoseBundle, FindsWhatCeresFinds) {
  constexpr std::size_t views = 5;
  Scene scene(views);
  PoseBundle bundle(small_camera(), views);
  std::vector<PoseCorrection> corrections(views, PoseCorrection{});
  double lens[2] = {0, 0};
  std::vector<std::array<double, 3>> offsets(120, {0, 0, 0});
  ceres::Problem problem;
  for (std::array<double, 3>& offset : offsets) {
    SharedPlace place = scene.shared(0.05 * scene.any(scene.rng));
    for (SharedPlace::Sighting& seen : place.sightings) {
      seen.pixel.x() += 0.5 * scene.any(scene.rng);
      if (scene.any(scene.rng) > 0.8) seen.pixel.y() += 8;  // a wrong one
      problem.AddResidualBlock(
          new ceres::NumericDiffCostFunction<Sighting, ceres::CENTRAL, 2, 6, 2, 3>(
              new Sighting{small_camera(), seen}),
          new ceres::CauchyLoss(0.7), corrections[seen.view].data(), lens, offset.data());
    }
    problem.AddResidualBlock(new ceres::NumericDiffCostFunction<Hold, ceres::CENTRAL, 1, 3>(
                                 new Hold{place.sight, place.sigma}),
                             new ceres::CauchyLoss(1), offset.data());
    bundle.add(std::move(place));
  }
  // Shared places hold the views to each other only: patches of the first hold it to the scene.
  for (int i = 0; i < 40; ++i) {
    const PatchMatch match = scene.match(0);
    bundle.add(0, match, 0.3);
    SharedPlace::Sighting seen{0, match.point, Eigen::Matrix3d::Identity(), match.seen,
                               match.sqrt_weight};
    static double nowhere[3] = {0, 0, 0};
    problem.AddResidualBlock(
        new ceres::NumericDiffCostFunction<Sighting, ceres::CENTRAL, 2, 6, 2, 3>(
            new Sighting{small_camera(), seen}),
        new ceres::ScaledLoss(new ceres::CauchyLoss(1), 0.3, ceres::TAKE_OWNERSHIP),
        corrections[0].data(), lens, nowhere);
    problem.SetParameterBlockConstant(nowhere);
  }
  problem.AddResidualBlock(
      new ceres::NumericDiffCostFunction<Near, ceres::CENTRAL, 2, 2>(new Near{free_lens}), nullptr,
      lens);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_SCHUR;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-10;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(bundle.solve(free_lens, {1, 0.7}, 200));

  EXPECT_NEAR(bundle.log_focal(), lens[0], 2e-4);
  EXPECT_NEAR(bundle.radial(), lens[1], 2e-3);
  for (std::size_t v = 0; v < views; ++v)
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_NEAR(bundle.corrections()[v][k], corrections[v][k], 3e-4) << v << ", " << k;
}

TEST(PoseBundle, ALensThatStaysStays) {
  Scene scene(2);
  PoseBundle bundle(small_camera(), 2);
  for (int i = 0; i < 30; ++i) bundle.add(1, scene.match(1), 1);
  ASSERT_TRUE(bundle.solve({}, {}, 30));
  EXPECT_EQ(bundle.log_focal(), 0);
  EXPECT_EQ(bundle.radial(), 0);
  EXPECT_EQ(bundle.corrections()[0], PoseCorrection{}) << "nothing holds it: it stays";
  EXPECT_NE(bundle.corrections()[1], PoseCorrection{});
}

TEST(PoseBundle, NothingSeenMovesNothing) {
  PoseBundle none(small_camera(), 0), blind(small_camera(), 3);
  EXPECT_TRUE(none.solve(free_lens, {}, 10));
  EXPECT_TRUE(blind.solve(free_lens, {}, 10));
  for (const PoseCorrection& correction : blind.corrections())
    EXPECT_EQ(correction, PoseCorrection{});
}

TEST(PoseBundle, NoAnswerFromBehindTheCameraOrFromNoNumber) {
  Scene scene(1);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Eigen::Vector3d& point :
       {Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(nan, 0, 2)}) {
    PoseBundle bundle(small_camera(), 1);
    PatchMatch match = scene.match(0);
    match.point = point;
    bundle.add(0, match, 1);
    EXPECT_FALSE(bundle.solve(free_lens, {}, 10));
  }
  PoseBundle bundle(small_camera(), 1);
  PatchMatch match = scene.match(0);
  match.seen.x() = nan;
  bundle.add(0, match, 1);
  EXPECT_FALSE(bundle.solve(free_lens, {}, 10));
}

TEST(PoseBundle, OnePatchAndHugeValuesEndInNumbers) {
  Scene scene(1);
  for (const double size : {1e-6, 1.0, 1e6}) {
    PoseBundle bundle(small_camera(), 1);
    PatchMatch match = scene.match(0);
    match.point *= size, match.seen *= size;
    bundle.add(0, match, 1);
    ASSERT_TRUE(bundle.solve(free_lens, {}, 30));
    for (const double value : bundle.corrections()[0]) EXPECT_TRUE(std::isfinite(value)) << size;
    EXPECT_TRUE(std::isfinite(bundle.log_focal()));
  }
}

TEST(PoseBundle, TheSameBitsForAnyNumberOfThreads) {
  const int usual = thread_count();
  std::vector<PoseCorrection> found[2];
  for (const int threads : {1, 4}) {
    set_thread_count(threads);
    Scene scene(6);
    PoseBundle bundle(small_camera(), 6);
    for (std::size_t v = 0; v < 6; ++v) bundle.add(v, scene.match(v), 1);
    for (int i = 0; i < 50; ++i) bundle.add(scene.shared(0.02));
    EXPECT_TRUE(bundle.solve(free_lens, {1, 1}, 20));
    found[threads == 1 ? 0 : 1] = bundle.corrections();
  }
  set_thread_count(usual);
  EXPECT_EQ(found[0], found[1]);
}

}  // namespace
}  // namespace orbitfuse
