// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/thermal_tracks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "core/numeric/median.hpp"
#include "tests/support/thermal_ball.hpp"

namespace orbitfuse {
namespace {

struct Views {
  ThermalViews views;
  std::vector<std::size_t> all;

  explicit Views(const testing_orbit::Ball& ball) {
    views.camera = ball.truth.front().camera;
    for (std::size_t i = 0; i < ball.truth.size(); ++i) {
      views.cam_from_world.push_back(ball.truth[i].cam_from_world);
      views.images.push_back(ball.orbit.images[i].clone());
      views.depth.push_back(
          testing_orbit::ball_view(views.camera, ball.truth[i].cam_from_world, false).depth);
    }
    all.resize(views.images.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
  }
  std::vector<ThermalTrack> tracks() const { return thermal_tracks(views, all, all, {}); }

  double median_px(const std::vector<ThermalTrack>& tracks) const {
    std::vector<double> off;
    for (const ThermalTrack& track : tracks)
      for (const ThermalSighting& seen : track.sightings)
        off.push_back(
            (views.camera.project(views.cam_from_world[seen.view] * track.surface) - seen.pixel)
                .norm());
    return median(off);
  }
};

TEST(ThermalTracks, OfExactPosesSightingsLieWhereTheSurfaceIs) {
  const Views ball{testing_orbit::Ball()};
  const std::vector<ThermalTrack> tracks = ball.tracks();
  ASSERT_GT(tracks.size(), 500U);
  EXPECT_LT(ball.median_px(tracks), 0.2);
  for (const ThermalTrack& track : tracks) {
    EXPECT_GE(track.sightings.size(), 2U);
    EXPECT_NEAR(track.sight.norm(), 1, 1e-9);
    for (const ThermalSighting& seen : track.sightings) {
      EXPECT_TRUE(seen.pixel.allFinite());
      EXPECT_TRUE(seen.sqrt_weight.allFinite());
    }
  }
}

TEST(ThermalTracks, AnImageShiftedByAFewPixelsIsFoundThere) {
  Views ball{testing_orbit::Ball()};
  const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, 3, 0, 1, -2);
  cv::warpAffine(ball.views.images[5], ball.views.images[5], shift, ball.views.images[5].size(),
                 cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  // Weighted: along an edge the shift is not known.
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const ThermalTrack& track : ball.tracks())
    for (const ThermalSighting& seen : track.sightings) {
      if (seen.view != 5 || track.sightings.front().view == 5) continue;
      const Eigen::Vector2d off =
          seen.pixel - ball.views.camera.project(ball.views.cam_from_world[5] * track.surface);
      const Eigen::Matrix2d weight = seen.sqrt_weight.transpose() * seen.sqrt_weight;
      information += weight, sum += weight * off;
    }
  ASSERT_GT(information.determinant(), 100);
  const Eigen::Vector2d shifted = information.inverse() * sum;
  EXPECT_NEAR(shifted.x(), 3, 0.4);
  EXPECT_NEAR(shifted.y(), -2, 0.4);
}

TEST(ThermalTracks, NoPatchReachesOverAnOutline) {
  const Views ball{testing_orbit::Ball()};
  const int radius = ThermalTrackOptions{}.radius_px;
  for (const ThermalTrack& track : ball.tracks()) {
    const ThermalSighting& first = track.sightings.front();
    const cv::Mat& depth = ball.views.depth[first.view];
    const cv::Rect patch(static_cast<int>(first.pixel.x()) - radius,
                         static_cast<int>(first.pixel.y()) - radius, 2 * radius + 1,
                         2 * radius + 1);
    // The ball's outline against the floor is a jump of a tenth and more.
    for (int y = patch.y; y < patch.y + patch.height; ++y)
      for (int x = patch.x + 1; x < patch.x + patch.width; ++x) {
        const float here = depth.at<float>(y, x), before = depth.at<float>(y, x - 1);
        EXPECT_FALSE(std::abs(here / before - 1) > 0.1F) << x << ", " << y;
      }
  }
}

TEST(ThermalTracks, OffsetsAndExtremeScalesOfTemperatureChangeNothing) {
  const Views ball{testing_orbit::Ball()};
  const auto usual = static_cast<double>(ball.tracks().size());
  for (const double scale : {1e-3, 1e3}) {
    Views other = ball;
    for (cv::Mat& image : other.views.images) image = image * scale + 300 * scale;
    const std::vector<ThermalTrack> tracks = other.tracks();
    EXPECT_NEAR(static_cast<double>(tracks.size()) / usual, 1, 0.05);
    EXPECT_LT(other.median_px(tracks), 0.2);
  }
}

TEST(ThermalTracks, NothingToFindGivesNone) {
  constexpr float infinite = std::numeric_limits<float>::infinity();
  for (const float value :
       {0.0F, 300.0F, 1e30F, infinite, -infinite, std::numeric_limits<float>::quiet_NaN()}) {
    Views flat{testing_orbit::Ball(4)};
    for (cv::Mat& image : flat.views.images) image.setTo(value);
    EXPECT_TRUE(flat.tracks().empty()) << value;
  }
  Views blind{testing_orbit::Ball(4)};
  for (cv::Mat& depth : blind.views.depth) depth.setTo(std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(blind.tracks().empty());
  EXPECT_TRUE(thermal_tracks(blind.views, {}, {}, {}).empty());
  EXPECT_TRUE(thermal_tracks(blind.views, {2}, {2}, {}).empty());
}

}  // namespace
}  // namespace orbitfuse
