// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/plain_background.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "recon/nerf/training/scene.hpp"
#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int view_count = 12, scene_pixels = 64;
const cv::Vec3f toy_background(0.1F, 0.2F, 0.3F);

Dataset plain_scene(double scale = 1) {
  return test::toy_scene(Modality::visible, view_count, scale, scene_pixels);
}

TEST(PlainBackground, IsWhatReachesInFromTheBorder) {
  Dataset data = plain_scene();
  // A patch of its colour in the middle of the ball is the ball's.
  for (TrainingView& view : data.views) {
    view.image = view.image.clone();
    cv::circle(view.image, {scene_pixels / 2, scene_pixels / 2}, 3, cv::Scalar(toy_background),
               cv::FILLED);
  }
  const auto background = find_plain_background(data);
  ASSERT_TRUE(background);
  EXPECT_LT(cv::norm(background->color, toy_background, cv::NORM_INF), 1e-6);
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    const cv::Mat& clear = background->clearance_px[i];
    ASSERT_EQ(clear.size(), data.views[i].image.size());
    EXPECT_EQ(clear.at<std::uint8_t>(scene_pixels / 2, scene_pixels / 2), 0);
    EXPECT_GT(clear.at<std::uint8_t>(0, 0), 8);
  }
}

TEST(PlainBackground, IsNotFoundInNoiseNorInTemperaturesNorInTwoViews) {
  Dataset noisy = plain_scene();
  cv::RNG random(3);
  for (TrainingView& view : noisy.views) {
    cv::Mat noise(view.image.size(), view.image.type());
    random.fill(noise, cv::RNG::NORMAL, 0.0, 0.02);
    view.image = view.image + noise;
  }
  EXPECT_FALSE(find_plain_background(noisy));
  EXPECT_FALSE(find_plain_background(test::toy_scene(Modality::thermal, view_count)));
  EXPECT_FALSE(find_plain_background(test::toy_scene(Modality::visible, 2)));
  EXPECT_FALSE(find_plain_background({}));
}

/// A gray ball of radius `scale` at `center`, seen from all round at four times that distance.
Dataset ball_from_all_round(double scale, const Eigen::Vector3d& center) {
  Dataset data;
  data.modality = Modality::visible;
  constexpr int count = 30;
  for (int i = 0; i < count; ++i) {
    const double z = -0.9 + 1.8 * i / (count - 1), a = 2.4 * i;  // a spiral over the sphere
    const Eigen::Vector3d out(std::sqrt(1 - z * z) * std::cos(a),
                              std::sqrt(1 - z * z) * std::sin(a), z);
    TrainingView view;
    view.name = std::to_string(i);
    view.camera = Camera::from_fov(96, 96, 40);
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond::FromTwoVectors(-out, Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d eye = center + 4 * scale * out;
    view.cam_from_world = {turn, -(turn * eye)};
    view.image = cv::Mat(96, 96, CV_32FC3, cv::Scalar::all(1));
    for (int y = 0; y < 96; ++y)
      for (int x = 0; x < 96; ++x) {
        const Eigen::Vector3d ray = view.camera.ray_of({x + 0.5, y + 0.5}).normalized();
        if (4 * std::sqrt(1 - ray.z() * ray.z()) < 1)
          view.image.at<cv::Vec3f>(y, x) = cv::Vec3f::all(0.5F);
      }
    data.views.push_back(view);
  }
  return data;
}

TEST(PlainBackground, SilhouettesBoundTheObjectAtExtremeScales) {
  for (const double scale : {1e-4, 1.0, 1e4}) {
    const Eigen::Vector3d center = scale * Eigen::Vector3d(3, -20, 1);
    const Dataset data = ball_from_all_round(scale, center);
    const auto background = find_plain_background(data);
    ASSERT_TRUE(background);
    Space space = estimate_space(data);
    EXPECT_GT(space.radius, 3.5 * scale);
    space = fit_to_silhouettes(*background, data, space);
    EXPECT_LT((space.center - center).norm(), 0.1 * scale);
    EXPECT_GE(space.radius, scale);  // the ball's
    EXPECT_LT(space.radius, 2.2 * scale) << "of a cube round it, and a cell";
    EXPECT_DOUBLE_EQ(fit_to_silhouettes(*background, data, space).radius, space.radius)
        << "and it stays";
  }
}

TEST(PlainBackground, OneViewThatLostTheObjectDoesNotCarveItAway) {
  Dataset data = ball_from_all_round(1, Eigen::Vector3d::Zero());
  const Space whole = fit_to_silhouettes(*find_plain_background(data), data, estimate_space(data));
  data.views[5].image.setTo(cv::Scalar::all(1));
  const Space space = fit_to_silhouettes(*find_plain_background(data), data, estimate_space(data));
  EXPECT_NEAR(space.radius, whole.radius, 0.1);
}

TEST(PlainBackground, EmptyScenesAndThoseThatGoOnKeepTheirSpace) {
  Dataset empty = plain_scene();
  for (TrainingView& view : empty.views)
    view.image = cv::Mat(scene_pixels, scene_pixels, CV_32FC3, cv::Scalar(toy_background));
  const auto background = find_plain_background(empty);
  ASSERT_TRUE(background);
  EXPECT_DOUBLE_EQ(background->share, 1);
  const Space given = estimate_space(empty);
  EXPECT_DOUBLE_EQ(fit_to_silhouettes(*background, empty, given).radius, given.radius);

  // Three views side by side leave a cone behind the ball.
  Dataset narrow = test::toy_scene(Modality::visible, 120, 1, scene_pixels);
  narrow.views.resize(3);
  const Space wide{Eigen::Vector3d::Zero(), 1.0};
  EXPECT_DOUBLE_EQ(fit_to_silhouettes(*find_plain_background(narrow), narrow, wide).radius, 1.0);
}

TEST(PlainBackground, AFieldBeforeItIsSharperThanWithoutKnowing) {
  Dataset data = test::toy_scene(Modality::visible, 16, 1, 48);
  for (std::size_t i = 0; i < data.views.size(); i += 4) data.views[i].measure_only = true;
  TrainOptions options = test::toy_options(Modality::visible, 400);
  options.texture_share = 0;  // noise is texture: the two would be drawn from differently
  Field field;
  const auto report = train(data, options, {}, field);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(std::any_of(report->skips.begin(), report->skips.end(),
                          [](const auto& skip) { return skip.what == "plain background"; }));
  // The same scene with a speck on each border pixel's worth of noise isn't told apart.
  Dataset hidden = data;
  cv::RNG random(5);
  for (TrainingView& view : hidden.views) {
    if (view.measure_only) continue;
    cv::Mat noise(view.image.size(), view.image.type());
    random.fill(noise, cv::RNG::UNIFORM, -0.02, 0.02);
    view.image = view.image + noise;
  }
  Field other;
  const auto without = train(hidden, options, {}, other);
  ASSERT_TRUE(without) << without.error().message();
  EXPECT_GT(report->best_psnr, without->best_psnr);
}

}  // namespace
}  // namespace orbitfuse::nerf
