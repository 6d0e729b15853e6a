// SPDX-License-Identifier: BSD-3-Clause
// Inputs at the edge: each has a defined answer.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "recon/nerf/field/field_state.hpp"
#include "recon/nerf/rendering/march.hpp"
#include "tests/recon/nerf/random_ray.hpp"
#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

using test::toy_options;
using test::toy_scene;

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();

void expect_finite(Field& field) {
  for (const std::vector<float>& values : field.state().snapshot(0).values)
    for (const float v : values) ASSERT_TRUE(std::isfinite(v));
}

Error error_of(const Dataset& data) {
  Field field;
  const auto report = train(data, toy_options(data.modality, 5), {}, field);
  EXPECT_FALSE(report);
  return report ? Error{} : report.error();
}

TEST(Stress, NoViewsIsAnInputError) { EXPECT_EQ(error_of({}).kind, ErrorKind::input); }

TEST(Stress, MalformedViewIsNamed) {
  Dataset data = toy_scene(Modality::visible, 4);
  data.views[2].image.at<cv::Vec3f>(3, 3)[1] = nan_value;
  EXPECT_EQ(error_of(data).where, "002.png");
  data = toy_scene(Modality::visible, 4);
  data.views[1].image = cv::Mat();
  EXPECT_EQ(error_of(data).where, "001.png");
  data = toy_scene(Modality::visible, 4);
  data.views[3].camera.width += 1;
  EXPECT_EQ(error_of(data).where, "003.png");
  data = toy_scene(Modality::thermal, 4);
  data.views[0].image.at<float>(0, 0) = std::numeric_limits<float>::infinity();
  EXPECT_EQ(error_of(data).where, "000.png");
  data = toy_scene(Modality::thermal, 2);
  for (TrainingView& view : data.views) view.image = nan_value;
  EXPECT_EQ(error_of(data).where, "000.png");
  data = toy_scene(Modality::thermal, 4);
  data.views[2].cam_from_world.translation.x() = nan_value;
  EXPECT_EQ(error_of(data).where, "002.png");
}

TEST(Stress, InvalidThermalPixelsAreNotTrainedOn) {
  Dataset data = toy_scene(Modality::thermal, 6);
  for (TrainingView& view : data.views)
    for (int x = 0; x < view.image.cols; x += 2) view.image.col(x) = nan_value;
  Field field;
  const auto report = train(data, toy_options(Modality::thermal, 40), {}, field);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->skipped_steps, 0);
  expect_finite(field);
}

TEST(Stress, ABrokenThermalViewIsDroppedWithItsNameAndDeadPixelsAreTold) {
  const Dataset good = toy_scene(Modality::thermal, 6);
  Dataset data = toy_scene(Modality::thermal, 7);
  for (std::size_t i = 0; i < 6; ++i) data.views[i == 0 ? 0 : i + 1] = good.views[i];
  data.views[1].name = "broken.tiff";
  data.views[1].image.rowRange(0, 17) = nan_value;  // of 32
  TrainOptions options = toy_options(Modality::thermal, 20);
  options.holdout_every = 3;
  Field with, without;
  const auto report = train(data, options, {}, with);
  ASSERT_TRUE(report) << report.error().message();
  ASSERT_EQ(report->warnings.size(), 1u);
  EXPECT_NE(report->warnings[0].find("broken.tiff dropped: 53 %"), std::string::npos)
      << report->warnings[0];
  EXPECT_EQ(report->image_offsets_k.size(), 6u);
  ASSERT_TRUE(train(good, options, {}, without));
  EXPECT_EQ(with.state().main.grid.table.values(), without.state().main.grid.table.values());

  data = good;
  data.views[2].image.at<float>(5, 5) = nan_value;
  const auto dead = train(data, options, {}, with);
  ASSERT_TRUE(dead);
  EXPECT_TRUE(dead->warnings.empty());
  const auto told = std::find_if(dead->skips.begin(), dead->skips.end(),
                                 [](const Skip& skip) { return skip.what == "dead pixels"; });
  ASSERT_TRUE(told != dead->skips.end());
  EXPECT_NE(told->why.find("002.png"), std::string::npos);
}

TEST(Stress, ACameraInsideTheObjectTrains) {
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    Dataset data = toy_scene(modality, 8);
    // Two stand in the ball and see its dark inside; depth, where known, is a hand's breadth.
    for (const std::size_t i : {1u, 5u}) {
      data.views[i].cam_from_world.translation *= 0.1;
      data.views[i].image =
          modality == Modality::visible ? cv::Scalar(0.05, 0.05, 0.05) : cv::Scalar(300);
      data.depth.push_back({static_cast<int>(i),
                            data.views[i].camera,
                            cv::Mat(32, 32, CV_32FC1, cv::Scalar(0.3)),
                            {},
                            {}});
    }
    Field field;
    const auto report = train(data, toy_options(modality, 80), {}, field);
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->skipped_steps, 0);
    expect_finite(field);
    EXPECT_GT(report->curve.back().train_psnr, 10) << name(modality);
    for (const std::size_t i : {0u, 1u}) {
      const auto view = render(field, data.views[i].camera, data.views[i].cam_from_world, {}, {});
      ASSERT_TRUE(view);
      EXPECT_TRUE(cv::checkRange(view->color));
    }
  }
}

TEST(Stress, OneViewAndTwoEqualViewsTrain) {
  for (const bool twice : {false, true}) {
    Dataset data = toy_scene(Modality::visible, 8);
    data.views.resize(1);
    if (twice) data.views.push_back(data.views[0]);
    Field field;
    const auto report = train(data, toy_options(Modality::visible, 40), {}, field);
    ASSERT_TRUE(report) << report.error().message();
    expect_finite(field);
  }
}

TEST(Stress, ConstantImagesGiveTheConstant) {
  Dataset data = toy_scene(Modality::thermal, 6);
  for (TrainingView& view : data.views) view.image = 300.0f;
  Field field;
  ASSERT_TRUE(train(data, toy_options(Modality::thermal, 80), {}, field));
  const auto view = render(field, data.views[0].camera, data.views[0].cam_from_world, {}, {});
  ASSERT_TRUE(view);
  EXPECT_LT(cv::norm(view->color, data.views[0].image, cv::NORM_INF), 0.5);
}

TEST(Stress, SceneSizeDoesNotMatter) {
  double at_one = 0;
  for (const double scale : {1.0, 1e-3, 1e4}) {
    const Dataset data = toy_scene(Modality::visible, 12, scale);
    Field field;
    const auto report = train(data, toy_options(Modality::visible, 120), {}, field);
    ASSERT_TRUE(report);
    const double psnr = report->curve.back().train_psnr;
    if (scale == 1.0) at_one = psnr;
    EXPECT_GT(psnr, 12) << scale;
    EXPECT_NEAR(psnr, at_one, 0.3) << scale;
    const auto view = render(field, data.views[0].camera, data.views[0].cam_from_world, {}, {});
    ASSERT_TRUE(view);
    EXPECT_TRUE(cv::checkRange(view->color));
  }
}

TEST(Stress, ExtremeTemperaturesStayFinite) {
  Dataset data = toy_scene(Modality::thermal, 6);
  data.views[0].image.at<float>(2, 2) = 0.0f;
  data.views[1].image.at<float>(2, 2) = 65535.0f;
  Field field;
  ASSERT_TRUE(train(data, toy_options(Modality::thermal, 60), {}, field));
  expect_finite(field);
}

TEST(Stress, CameraInsideTheObjectAndEmptySpaceRender) {
  const Dataset data = toy_scene(Modality::visible, 8);
  Field field;
  ASSERT_TRUE(train(data, toy_options(Modality::visible, 60), {}, field));
  Rigid3d inside = data.views[0].cam_from_world;
  inside.translation.setZero();
  auto view = render(field, data.views[0].camera, inside, {}, {});
  ASSERT_TRUE(view);
  EXPECT_TRUE(cv::checkRange(view->color));
  std::fill(field.state().occupancy.on.begin(), field.state().occupancy.on.end(), 0);
  field.state().occupancy.refresh();
  view = render(field, data.views[0].camera, data.views[0].cam_from_world, {}, {});
  ASSERT_TRUE(view);
  EXPECT_TRUE(cv::checkRange(view->color));
  EXPECT_EQ(cv::countNonZero(view->opacity > 0.5), 0);
  EXPECT_EQ(cv::countNonZero(view->depth == view->depth), 0) << "no surface, no depth";
  inside.translation.x() = nan_value;
  EXPECT_FALSE(render(field, data.views[0].camera, inside, {}, {}));
}

TEST(Stress, StepsWithoutFiniteGradientsAreSkippedAndARunOfThemIsAnError) {
  const Dataset data = toy_scene(Modality::visible, 6);
  Field guide;
  ASSERT_TRUE(train(data, toy_options(Modality::visible, 5), {}, guide));
  guide.state().main.mlp.weights.value[0] = nan_value;
  TrainOptions options = toy_options(Modality::visible, 6);
  options.shared_geometry = true;
  Field field;
  const auto report = train(data, options, {}, field, &guide);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::quality);
  EXPECT_NE(report.error().found.find("none of the 6 steps"), std::string::npos);
}

Marched march_one(const Occupancy& grid, const Ray& ray) {
  Marched out;
  const DrawnRay drawn{.ray = ray};
  march(grid, {}, &drawn, 1, &out);
  return out;
}

TEST(Occupancy, RaysThatMissAndDegenerateRaysGetNoSamples) {
  Occupancy grid;
  grid.create(16, 3);
  EXPECT_EQ(march_one(grid, {{100, 100, 100}, {0, 0, 1}, 1}).count, 0);
  std::fill(grid.on.begin(), grid.on.end(), 0);
  grid.refresh();
  EXPECT_EQ(march_one(grid, {{0, 0, 0}, {0, 0, 1}, 1}).count, 0);
}

TEST(Occupancy, SamplesCoverTheOccupiedLengthInOrder) {
  Occupancy grid;
  grid.create(16, 3);
  for (int k = 0; k < 50; ++k) {
    const float a = 0.37f * static_cast<float>(k), b = 0.91f * static_cast<float>(k);
    const Ray ray{{std::cos(a), std::sin(a), 0.2f}, {std::cos(b), std::sin(b), 0}, 1};
    for (std::size_t c = 0; c < grid.density.size(); ++c)
      grid.density[c] = static_cast<float>((c * 2654435761u) >> 8 & 31);
    grid.refresh();
    const auto [count, t, dt] = march_one(grid, ray);
    ASSERT_GT(count, 0);
    double covered = 0;
    for (int i = 0; i < count; ++i) {
      if (i > 0) {
        EXPECT_GE(t[i], t[i - 1]);
      }
      EXPECT_GE(dt[i], 0);
      covered += dt[i];
    }
    // All cells are on, so the samples stand for everything up to the largest cube's edge.
    double edge = 1e9;
    for (int d = 0; d < 3; ++d)
      if (std::abs(ray.direction[d]) > 1e-6f)
        edge = std::min(edge, (4.0 - std::copysign(1.0, ray.direction[d]) * ray.origin[d]) /
                                  std::abs(ray.direction[d]));
    EXPECT_NEAR(covered, edge - 0.1, 0.05 * edge);
  }
}

TEST(Occupancy, WholeBlocksAreCrossedAsTheirCellsWouldBe) {
  Occupancy grid;
  grid.create(16, 2);
  cv::RNG random(5);
  for (std::size_t block = 0; block < grid.on.size(); ++block) {
    const int kind = random.uniform(0, 4);  // empty, plain, known densities throughout, holes
    grid.on[block] = kind == 0 ? 0 : ~std::uint64_t{0};
    for (std::size_t cell = 64 * block; cell < 64 * (block + 1); ++cell) {
      if (kind >= 2) grid.density[cell] = random.uniform(0.0f, 3.0f);
      if (kind == 3)
        Occupancy::put(grid.on, static_cast<std::int64_t>(cell), random.uniform(0, 2) == 1);
    }
  }
  grid.refresh();
  for (int k = 0; k < 50; ++k) {
    Ray ray{{random.uniform(-0.9f, 0.9f), random.uniform(-0.9f, 0.9f), -1.5f},
            {random.uniform(-0.4f, 0.4f), random.uniform(-0.4f, 0.4f), 1},
            1};
    const float norm =
        std::sqrt(ray.direction[0] * ray.direction[0] + ray.direction[1] * ray.direction[1] + 1);
    for (float& d : ray.direction) d /= norm;
    constexpr double step = 1e-3;
    double occupied = 0;
    for (double at = 0.1 + step / 2; at < 8; at += step) {
      float x[3];
      for (int d = 0; d < 3; ++d) x[d] = ray.origin[d] + static_cast<float>(at) * ray.direction[d];
      const int cascade = Occupancy::cascade_of(x);
      if (cascade >= grid.cascades) break;
      occupied += Occupancy::test(grid.on, grid.cell_of(cascade, x)) ? step : 0;
    }
    const auto [count, t, dt] = march_one(grid, ray);
    double covered = 0;
    for (int i = 0; i < count; ++i) covered += dt[i];
    EXPECT_NEAR(covered, occupied, 0.02 * occupied + 0.01) << k;
  }
}

TEST(Occupancy, ARayDoesNotDependOnThoseBesideIt) {
  Occupancy grid;
  grid.create(32, 3);
  cv::RNG random(9);
  for (std::size_t c = 0; c < grid.density.size(); ++c) {
    Occupancy::put(grid.on, static_cast<std::int64_t>(c), random.uniform(0, 3) == 0);
    if (random.uniform(0, 2) == 0) grid.density[c] = random.uniform(0.0f, 5.0f);
  }
  grid.refresh();
  std::vector<DrawnRay> rays(march_lanes);
  for (DrawnRay& drawn : rays) {
    test::draw_ray(random, 1.0f, drawn.ray);
    drawn.far = random.uniform(0.5f, 9.0f);
    drawn.jitter = random.uniform(0.0f, 1.0f);
  }
  rays[2].ray.origin[1] = 50;                // outside, away from the scene or towards it
  rays[5].ray.direction[0] = std::nanf("");  // a camera model's failure must stay its own
  rays[6].far = 0;
  std::vector<Marched> together(march_lanes);
  march(grid, {}, rays.data(), march_lanes, together.data());
  int samples = 0;
  for (std::size_t r = 0; r < rays.size(); ++r) {
    Marched alone;
    march(grid, {}, &rays[r], 1, &alone);
    ASSERT_EQ(alone.count, together[r].count) << r;
    samples += alone.count;
    for (int i = 0; i < alone.count; ++i) {
      EXPECT_EQ(alone.t[i], together[r].t[i]);
      EXPECT_EQ(alone.dt[i], together[r].dt[i]);
    }
  }
  EXPECT_GT(samples, 50);
  EXPECT_EQ(together[5].count, 0);
  EXPECT_EQ(together[6].count, 0);
}

}  // namespace
}  // namespace orbitfuse::nerf
