// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/find_scale.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "app/stages/artifacts.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::exporting {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;

TEST(FindScale, LengthsNeedAUnit) {
  EXPECT_DOUBLE_EQ(*metres_of("--distance", "1.20m"), 1.2);
  EXPECT_DOUBLE_EQ(*metres_of("--distance", "35cm"), 0.35);
  EXPECT_DOUBLE_EQ(*metres_of("--distance", "350mm"), 0.35);
  for (const char* words : {"", "m", "1.20", "1,20m", "-1m", "0m", "nanm", "infm", "1e9m", "1 m",
                            "1.2m.", "12in", "0x10m"}) {
    const auto metres = metres_of("--distance", words);
    ASSERT_FALSE(metres) << words;
    EXPECT_EQ(metres.error().kind, ErrorKind::usage);
  }
}

/// Cameras on a circle in metres, and as a run of 0.25 m a unit has them, each off by `noise_m`.
std::vector<PosePair> circle(int count, double noise_m) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, noise_m);
  const Similarity3d run_from_metres{
      4,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())),
      {5, -2, 1}};
  std::vector<PosePair> pairs;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d eye(3 * std::cos(0.5 * i), 3 * std::sin(0.5 * i), 1 + 0.5 * (i % 3));
    const Rigid3d truth{Eigen::Quaterniond::Identity(), -eye};
    const Rigid3d seen{Eigen::Quaterniond::Identity(),
                       -(eye + Eigen::Vector3d(noise(random), noise(random), noise(random)))};
    pairs.push_back({rebase(seen, run_from_metres), truth, "view"});
  }
  return pairs;
}

TEST(FindScale, CamerasGiveItWithItsUncertainty) {
  const auto exact = scale_of_cameras(circle(12, 0), "mat");
  ASSERT_TRUE(exact) << exact.error().message();
  EXPECT_NEAR(exact->metres_per_unit, 0.25, 1e-9);
  EXPECT_LT(exact->relative_uncertainty, 1e-6);
  const auto noisy = scale_of_cameras(circle(12, 0.03), "mat");
  ASSERT_TRUE(noisy);
  EXPECT_GT(noisy->relative_uncertainty, 0.0005);
  EXPECT_LT(std::abs(noisy->metres_per_unit / 0.25 - 1), 3 * noisy->relative_uncertainty);
  EXPECT_EQ(noisy->source, "mat");
}

TEST(FindScale, OneWrongCameraDoesNotDecide) {
  auto pairs = circle(12, 0.001);
  pairs[5].cam_from_truth.translation += Eigen::Vector3d(0, 1.5, 0);
  const auto scale = scale_of_cameras(pairs, "mat");
  ASSERT_TRUE(scale);
  EXPECT_NEAR(scale->metres_per_unit, 0.25, 0.002);
}

TEST(FindScale, CamerasThatSayNothingAreNamed) {
  EXPECT_FALSE(scale_of_cameras(circle(2, 0), "mat"));
  auto still = circle(12, 0);
  for (PosePair& pair : still) pair.cam_from_truth = still[0].cam_from_truth;
  EXPECT_FALSE(scale_of_cameras(still, "mat"));
  auto others = circle(12, 0);
  for (std::size_t i = 0; i < others.size(); ++i)  // another order: not the same cameras
    others[i].cam_from_truth = circle(12, 0)[i * 5 % 12].cam_from_truth;
  const auto scale = scale_of_cameras(others, "mat");
  ASSERT_FALSE(scale);
  EXPECT_EQ(scale.error().kind, ErrorKind::input);
}

/// A run whose cameras are the circle's, and a session that came with poses, off by `noise_m`.
view::FinishedRun run_with_poses(double noise_m) {
  view::FinishedRun run;
  run.session.emplace();
  for (const PosePair& pair : circle(12, noise_m)) {
    const std::string file = "visible/" + std::to_string(run.views.size()) + ".jpg";
    run.views.push_back({});
    run.views.back().view = {file, Camera::from_fov(64, 48, 50), pair.cam_from_estimate};
    run.session->frames.push_back({});
    run.session->frames.back().file = file;
    run.session->frames.back().cam_from_world = pair.cam_from_truth;
  }
  return run;
}

TEST(FindScale, PosesThatTheRunTookAsTheyAreNeedTheirErrorToBeTold) {
  const auto fitted = scale_of_known_poses(run_with_poses(0.03), std::nullopt);
  ASSERT_TRUE(fitted) << fitted.error().message();
  EXPECT_NEAR(fitted->metres_per_unit, 0.25, 0.25 * 3 * fitted->relative_uncertainty);

  const auto silent = scale_of_known_poses(run_with_poses(0), std::nullopt);
  ASSERT_FALSE(silent) << "an uncertainty of nothing";
  EXPECT_EQ(silent.error().kind, ErrorKind::usage);
  EXPECT_THAT(silent.error().remedy, HasSubstr("--pose-error"));

  // 12 cameras 3 m round a middle: 1 cm an axis over the root of the sum of squares.
  const auto told = scale_of_known_poses(run_with_poses(0), 0.01);
  ASSERT_TRUE(told);
  EXPECT_NEAR(told->metres_per_unit, 0.25, 1e-9);
  EXPECT_NEAR(told->relative_uncertainty, 0.01 / (3 * std::sqrt(12)),
              0.1 * told->relative_uncertainty);
  // What the fit shows counts where it is more.
  EXPECT_EQ(scale_of_known_poses(run_with_poses(0.03), 0.001)->relative_uncertainty,
            fitted->relative_uncertainty);
}

TEST(FindScale, PlacesThatAreNoneAreNamed) {
  view::FinishedRun run;
  run.radius = 1;
  const auto metres = [&](const measurement::Place& a, const measurement::Place& b) {
    return scale_of_distance(run, a, b, 1.2, {});
  };
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  const auto good = metres(origin, Eigen::Vector3d(0.3, 0, 0));
  ASSERT_TRUE(good);
  EXPECT_NEAR(good->metres_per_unit, 4, 1e-12);
  EXPECT_GT(good->relative_uncertainty, 0);
  EXPECT_THAT(metres(origin, origin).error().message(), HasSubstr("that are one"));
  EXPECT_FALSE(metres(origin, Eigen::Vector3d(std::nan(""), 0, 0)));
  EXPECT_FALSE(metres(origin, Eigen::Vector3d(1e300, 0, 0)));
  EXPECT_THAT(metres(origin, Eigen::Vector3d(0, 250, 260)).error().message(),
              HasSubstr("outside of the scene"));
  EXPECT_THAT(metres(origin, measurement::PixelPlace{"visible/9.jpg", {1, 1}}).error().message(),
              HasSubstr("no posed view"));
  // So near each other that pointing is as coarse as the distance.
  EXPECT_FALSE(metres(origin, Eigen::Vector3d(0.001, 0, 0)));
}

TEST(MetricScaleFile, IsOfItsPosesOnly) {
  const fs::path out = fs::path(::testing::TempDir()) / "orbitfuse_scale";
  fs::remove_all(out);
  fs::create_directories(out);
  EXPECT_FALSE(stages::load_metric_scale(out, "world")->has_value());
  const stages::MetricScale scale{0.25, 0.004, "one distance", "words"};
  ASSERT_TRUE(stages::save_metric_scale(out, "world", scale));
  const auto back = stages::load_metric_scale(out, "world");
  ASSERT_TRUE(back && back->has_value());
  EXPECT_EQ((*back)->metres_per_unit, 0.25);
  EXPECT_EQ((*back)->relative_uncertainty, 0.004);
  EXPECT_THAT(stages::load_metric_scale(out, "another").error().message(),
              HasSubstr("other poses"));
  EXPECT_FALSE(stages::save_metric_scale(out, "world", {0, 0.1, "", ""}));
  EXPECT_FALSE(stages::save_metric_scale(out, "world", {std::nan(""), 0.1, "", ""}));
  EXPECT_FALSE(stages::save_metric_scale(out, "world", {1, 2, "", ""}));
  for (const char* text : {"", "[]", "{}", "{\"schema\":1}", "{\"schema\":2}", "not JSON",
                           "{\"schema\":1,\"world\":5,\"metres_per_unit\":\"x\"}"}) {
    ASSERT_TRUE(write_file_atomic(out / stages::scale_file, text));
    const auto damaged = stages::load_metric_scale(out, "world");
    ASSERT_FALSE(damaged) << text;
    EXPECT_THAT(damaged.error().message(), HasSubstr("scale.json")) << text;
    EXPECT_THAT(damaged.error().remedy, HasSubstr("--distance")) << text;
    EXPECT_THAT(stages::scale_words(damaged), HasSubstr("can't be used")) << text;
  }
}

TEST(MetricScaleFile, OfARunIsNothingOnlyWhereThereIsNone) {
  const fs::path out = fs::path(::testing::TempDir()) / "orbitfuse_scale_of_run";
  fs::remove_all(out);
  fs::create_directories(out);
  const auto none = stages::scale_of_run(out);
  ASSERT_TRUE(none);
  EXPECT_FALSE(none->has_value());
  EXPECT_THAT(stages::scale_words(none), HasSubstr("no scale"));
  ASSERT_TRUE(write_file_atomic(out / stages::scale_file, "{}"));
  EXPECT_FALSE(stages::scale_of_run(out)) << "there are no poses that it could belong to";
  fs::remove(out / stages::scale_file);
  fs::create_symlink("gone.json", out / stages::scale_file);
  EXPECT_FALSE(stages::scale_of_run(out)) << "a link that leads nowhere";
}

TEST(MetricScale, TwoThatAgreeAreOneAndTwoThatDoNotAreNone) {
  const stages::MetricScale by_mat{0.25, 0.002, "mat", "24 cameras"},
      by_hand{0.251, 0.006, "one distance", "3 units are 0.75 m"};
  const auto both = stages::agreed_scale(by_mat, by_hand);
  ASSERT_TRUE(both);
  // Nine tenths of the weight are the mat's.
  EXPECT_NEAR(both->metres_per_unit, 0.2501, 1e-5);
  EXPECT_NEAR(both->relative_uncertainty, 0.002 * std::sqrt(0.9), 1e-6);
  EXPECT_THAT(both->source, HasSubstr("mat and one distance"));
  EXPECT_FALSE(stages::agreed_scale(by_mat, {0.26, 0.006, "one distance", ""}));
  EXPECT_EQ(stages::agreed_scale(by_mat, {0.2502, 0.001, "mat", "again"})->how, "again")
      << "one mat's own error is in both";
  const stages::MetricScale exact{0.25, 0, "known poses", ""};
  ASSERT_TRUE(stages::agreed_scale(exact, exact));
  EXPECT_NEAR(stages::agreed_scale(exact, by_hand)->metres_per_unit, 0.25, 1e-6);
  EXPECT_FALSE(stages::agreed_scale(exact, {0.2501, 0, "known poses", ""}));
}

}  // namespace
}  // namespace orbitfuse::exporting
