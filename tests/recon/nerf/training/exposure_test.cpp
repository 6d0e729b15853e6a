// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/exposure.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int exposed_views = 12;

Eigen::Array3d log_gain_of(std::size_t view) {
  const double a = static_cast<double>(view);
  return {0.3 * std::sin(a), 0.3 * std::sin(a) + 0.05 * std::cos(2 * a),
          0.3 * std::sin(a) - 0.04 * std::cos(3 * a)};
}

/// Each view stored with a gain of its own, clipped as cameras clip.
Dataset varied_scene() {
  Dataset data = test::toy_scene(Modality::visible, exposed_views, 1, 64);
  data.depth = test::toy_depth(data);
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    data.views[i].image = data.views[i].image.clone();
    const Eigen::Array3d gain = log_gain_of(i).exp();
    cv::multiply(data.views[i].image, cv::Scalar(gain[0], gain[1], gain[2]), data.views[i].image);
    data.views[i].image = cv::min(data.views[i].image, 1.0);
  }
  return data;
}

std::vector<bool> none_heldout() { return std::vector<bool>(exposed_views, false); }

/// Largest difference from what was put in, both with mean zero over `heldout`'s others.
double worst_error(const Exposure& exposure, const std::vector<bool>& heldout) {
  Eigen::Array3d mean = Eigen::Array3d::Zero();
  int count = 0;
  for (std::size_t i = 0; i < heldout.size(); ++i) {
    if (heldout[i]) continue;
    mean += log_gain_of(i);
    ++count;
  }
  mean /= count;
  double worst = 0;
  for (std::size_t i = 0; i < heldout.size(); ++i)
    worst = std::max(worst, (exposure.log_gain[i] - (log_gain_of(i) - mean)).abs().maxCoeff());
  return worst;
}

TEST(Exposure, OfEachViewAndChannelIsFound) {
  const Exposure exposure = estimate_exposure(varied_scene(), none_heldout());
  EXPECT_TRUE(exposure.varies());
  EXPECT_GT(exposure.points, 1000);
  EXPECT_LT(worst_error(exposure, none_heldout()), 0.02);
}

TEST(Exposure, OfAQuarterOfWrongMatchesIsStillFound) {
  Dataset data = varied_scene();
  data.depth.clear();
  // Tracks of a thousand points of the ball, every fourth observation somewhere else.
  for (int p = 0; p < 1000; ++p) {
    const double z = 0.8 * std::sin(p * 0.77), a = p * 2.4, r = std::sqrt(1 - z * z);
    SparsePoint point;
    const Eigen::Vector3d normal(r * std::cos(a), r * std::sin(a), z);
    point.position = 0.4 * normal;
    for (int v = 0; v < exposed_views; ++v) {
      const TrainingView& view = data.views[static_cast<std::size_t>(v)];
      const Eigen::Vector3d center = camera_center(view.cam_from_world);
      if ((center - point.position).normalized().dot(normal) < 0.3) continue;
      Eigen::Vector2d pixel = view.camera.project(view.cam_from_world * point.position);
      if ((p + v) % 4 == 0) pixel = {31 + 6 * std::sin(p * 1.3), 31 + 6 * std::cos(p * 1.7)};
      point.track.push_back({v, pixel});
    }
    data.points.push_back(point);
  }
  EXPECT_LT(worst_error(estimate_exposure(data, none_heldout()), none_heldout()), 0.06);
}

TEST(Exposure, OfHeldOutViewsIsFoundAndHasNoSay) {
  std::vector<bool> heldout = none_heldout();
  heldout[3] = heldout[8] = true;
  Dataset data = varied_scene();
  const Exposure exposure = estimate_exposure(data, heldout);
  EXPECT_LT(worst_error(exposure, heldout), 0.05);
  data.views[3].image.setTo(cv::Scalar(0.9, 0.1, 0.5));
  const Exposure other = estimate_exposure(data, heldout);
  EXPECT_EQ(exposure.spread, other.spread);
  for (std::size_t i = 0; i < heldout.size(); ++i)
    if (!heldout[i]) {
      EXPECT_TRUE((exposure.log_gain[i] == other.log_gain[i]).all()) << i;
    }
}

TEST(Exposure, ThatIsSteadyIsLeftAlone) {
  Dataset data = test::toy_scene(Modality::visible, exposed_views, 1, 64);
  data.depth = test::toy_depth(data);
  const Exposure exposure = estimate_exposure(data, none_heldout());
  EXPECT_FALSE(exposure.varies());
  EXPECT_LT(exposure.spread, 0.005);
}

TEST(Exposure, OfAViewWithAFewWrongMatchesIsOne) {
  Dataset data = varied_scene();
  data.depth.pop_back();
  for (int p = 0; p < 3; ++p)  // all that ties the last view to another
    data.points.push_back(
        {{0, 0, 0.4}, {}, 0, {{exposed_views - 1, {20.0 + p, 30}}, {2, {40, 30.0 + p}}}});
  const Exposure exposure = estimate_exposure(data, none_heldout());
  EXPECT_TRUE((exposure.log_gain.back() == 0).all()) << exposure.log_gain.back().transpose();
  EXPECT_TRUE(exposure.varies());
}

TEST(Exposure, OfOneWildViewAmongManyIsTold) {
  Exposure exposure;
  exposure.spread = 0.01;
  EXPECT_FALSE(exposure.varies());
  exposure.largest = 0.7;
  EXPECT_TRUE(exposure.varies());
}

TEST(Exposure, OfViewsWithNothingInCommonIsOne) {
  const auto expect_none = [](const Dataset& data) {
    const Exposure exposure = estimate_exposure(data, std::vector<bool>(data.views.size(), false));
    EXPECT_FALSE(exposure.varies());
    for (const Eigen::Array3d& gain : exposure.log_gain) EXPECT_TRUE((gain == 0).all());
  };
  Dataset data = varied_scene();
  data.depth.clear();
  expect_none(data);  // no correspondence
  data = varied_scene();
  for (TrainingView& view : data.views) view.image.setTo(0);
  expect_none(data);  // nothing but darkness
  for (TrainingView& view : data.views) view.image.setTo(1);
  expect_none(data);  // nothing but what was clipped
  data = varied_scene();
  data.views.resize(1);
  data.depth.resize(1);
  expect_none(data);
}

TEST(Exposure, EvenedOutIsThatOfEveryViewAndLeavesOutWhatWasClipped) {
  const Dataset plain = test::toy_scene(Modality::visible, exposed_views, 1, 64),
                varied = varied_scene();
  std::vector<NormalisedView> views = prepare_views(varied, {}, {});
  Exposure exposure;
  for (std::size_t i = 0; i < exposed_views; ++i) exposure.log_gain.push_back(log_gain_of(i));
  even_out(exposure, views);
  int unknown = 0;
  for (std::size_t i = 0; i < exposed_views; ++i)
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x) {
        const auto& seen = views[i].target.at<cv::Vec3f>(y, x);
        const auto& stored = varied.views[i].image.at<cv::Vec3f>(y, x);
        const auto& truth = plain.views[i].image.at<cv::Vec3f>(y, x);
        if (!std::isfinite(seen[0])) {
          ++unknown;
          EXPECT_GE(std::max({stored[0], stored[1], stored[2]}), 0.96f);
          continue;
        }
        // A gain within 3 % keeps its highlights.
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(seen[c], truth[c], stored[c] < 1 ? 1e-5 : 0.03) << i;
      }
  EXPECT_GT(unknown, 0);
}

TEST(Exposure, OfACameraOnAutomaticCostsLittle) {
  const auto psnr_with = [](bool even) {
    Dataset data = varied_scene();
    for (TrainingView& truth : test::toy_scene(Modality::visible, exposed_views, 1, 64).views) {
      truth.name = "true_" + truth.name;
      truth.measure_only = true;
      data.views.push_back(truth);
    }
    TrainOptions options = test::toy_options(Modality::visible, 200);
    options.even_exposure = even;
    options.keep_best = false;
    Field field;
    const auto report = train(data, options, {}, field);
    EXPECT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->image_gains.size(), even ? data.views.size() : 0u);
    return report->best_psnr;
  };
  EXPECT_GT(psnr_with(true), psnr_with(false) + 3);
}

}  // namespace
}  // namespace orbitfuse::nerf
