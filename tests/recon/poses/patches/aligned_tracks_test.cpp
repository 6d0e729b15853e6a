// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/patches/aligned_tracks.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "core/system/parallel.hpp"

namespace orbitfuse {
namespace {

/// A wall z = 0 whose grey level is smooth, waves of some 15 px, and has no direction or period.
double wall(double x, double y) {
  x *= 8, y *= 8;
  return 128 + 40 * std::sin(9.1 * x + 2.3 * std::sin(5.7 * y)) +
         40 * std::cos(8.3 * y + 1.9 * std::sin(6.1 * x)) + 20 * std::sin(17.3 * x - 13.9 * y);
}

/// A camera on an arc about the origin, `azimuth_deg` off the wall's normal.
PosedView view_at(double azimuth_deg) {
  const double azimuth = azimuth_deg * std::numbers::pi / 180;
  const Eigen::Vector3d centre(2 * std::sin(azimuth), 0, -2 * std::cos(azimuth));
  const Eigen::Quaterniond rotation(
      Eigen::AngleAxisd(azimuth, Eigen::Vector3d::UnitY()).toRotationMatrix());
  PosedView view;
  view.name = std::to_string(azimuth_deg);
  view.camera = Camera::from_fov(320, 240, 50);
  view.cam_from_world = {rotation, -(rotation * centre)};
  return view;
}

cv::Mat picture_of(const PosedView& view, double gain = 1, double offset = 0) {
  const Rigid3d world_from_cam = view.cam_from_world.inverse();
  cv::Mat image(view.camera.height, view.camera.width, CV_32F);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const Eigen::Vector3d ray = world_from_cam.rotation * view.camera.ray_of({x + 0.5, y + 0.5});
      const Eigen::Vector3d p =
          world_from_cam.translation - world_from_cam.translation.z() / ray.z() * ray;
      image.at<float>(y, x) = static_cast<float>(gain * wall(p.x(), p.y()) + offset);
    }
  return image;
}

struct WallScene {
  Reconstruction model;
  std::vector<cv::Mat> images;  ///< the first brighter and of more contrast than the others

  /// Points seen by the first two of the views, by the second half a pixel off.
  explicit WallScene(const std::vector<double>& azimuths_deg) {
    for (const double azimuth : azimuths_deg) {
      model.views.push_back(view_at(azimuth));
      images.push_back(picture_of(model.views.back(), 0.7, 30));
    }
    images[0] = picture_of(model.views[0]);
    cv::RNG random(7);
    for (int i = 0; i < 200; ++i) {
      SparsePoint point;
      point.position = {random.uniform(-0.6, 0.6), random.uniform(-0.5, 0.5), 0};
      const Eigen::Vector2d noise(random.gaussian(0.5), random.gaussian(0.5));
      point.track = {{0, exact(point, 0)}, {1, exact(point, 1) + noise}};
      model.points.push_back(point);
    }
  }

  Eigen::Vector2d exact(const SparsePoint& point, int view) const {
    const PosedView& posed = model.views[static_cast<std::size_t>(view)];
    return posed.camera.project(posed.cam_from_world * point.position);
  }
  /// How far what a track shows in `view` is from what it shows in the first view, on the wall.
  double rms_px(const Reconstruction& of, int view) const {
    double sum = 0;
    int count = 0;
    for (const SparsePoint& point : of.points)
      for (const Observation& first : point.track)
        for (const Observation& seen : point.track) {
          if (first.view != 0 || seen.view != view) continue;
          const PosedView& posed = model.views[0];
          const Rigid3d world_from_cam = posed.cam_from_world.inverse();
          const Eigen::Vector3d ray = world_from_cam.rotation * posed.camera.ray_of(first.pixel);
          SparsePoint shown;
          shown.position =
              world_from_cam.translation - world_from_cam.translation.z() / ray.z() * ray;
          sum += (seen.pixel - exact(shown, view)).squaredNorm(), ++count;
        }
    return count == 0 ? std::nan("") : std::sqrt(sum / count);
  }
};

TEST(AlignedTracks, ObservationsComeToWhereTheSurfaceIs) {
  const WallScene scene({0, 25});
  EXPECT_GT(scene.rms_px(scene.model, 1), 0.6);
  const TrackAlignment aligned = align_tracks(scene.model, scene.images, {}, {}).value();
  EXPECT_GT(aligned.aligned, 150);
  EXPECT_EQ(aligned.added, 0);
  EXPECT_LT(scene.rms_px(aligned.model, 1), 0.05);
  EXPECT_NEAR(aligned.rms_shift_px, 0.7, 0.15);
}

int seen_by(const Reconstruction& model, int view) {
  int count = 0;
  for (const SparsePoint& point : model.points)
    for (const Observation& seen : point.track) count += seen.view == view ? 1 : 0;
  return count;
}

TEST(AlignedTracks, AViewThatNoFeatureJoinedIsFoundWithinReach) {
  const WallScene scene({0, 25, -30});
  const TrackAlignment aligned = align_tracks(scene.model, scene.images, {}, {}).value();
  EXPECT_GT(seen_by(aligned.model, 2), 100);
  EXPECT_EQ(aligned.added, seen_by(aligned.model, 2));
  EXPECT_LT(scene.rms_px(aligned.model, 2), 0.08);
  TrackAlignmentOptions near;
  near.max_added_angle_deg = 15;
  EXPECT_EQ(align_tracks(scene.model, scene.images, near, {})->added, 0);
  TrackAlignmentOptions none;
  none.max_added_views = 0;
  EXPECT_EQ(align_tracks(scene.model, scene.images, none, {})->added, 0);
}

TEST(AlignedTracks, WhereNoFeatureSpeaksForAPlaceNothingIsAdded) {
  WallScene scene({0, 25, -30});
  scene.images[1].setTo(128);
  const TrackAlignment aligned = align_tracks(scene.model, scene.images, {}, {}).value();
  EXPECT_EQ(aligned.added, 0);
  EXPECT_EQ(seen_by(aligned.model, 2), 0) << "the model's poses alone know it there";
}

TEST(AlignedTracks, APlaceBeyondReachIsAnotherOne) {
  WallScene scene({0, 25});
  for (SparsePoint& point : scene.model.points)
    point.track[1].pixel = scene.exact(point, 1) + Eigen::Vector2d(1.5, 0);
  TrackAlignmentOptions options;
  EXPECT_GT(align_tracks(scene.model, scene.images, options, {})->aligned, 150);
  options.max_shift_px = 1;
  EXPECT_EQ(align_tracks(scene.model, scene.images, options, {})->aligned, 0);
  options.max_shift_px = 2, options.max_sigma_px = 1e-4;
  EXPECT_EQ(align_tracks(scene.model, scene.images, options, {})->aligned, 0);
  options.max_sigma_px = 0.15, options.max_magnification = 1;
  EXPECT_EQ(align_tracks(scene.model, scene.images, options, {})->aligned, 0)
      << "from aside the wall is narrower";
}

TEST(AlignedTracks, WhatIsKeptForAWeakViewCountsAsNotFound) {
  WallScene scene({0, 25});
  scene.images[1].setTo(128);
  const TrackAlignment aligned = align_tracks(scene.model, scene.images, {}, {}).value();
  EXPECT_EQ(aligned.left_out, 0);
  EXPECT_EQ(aligned.unaligned, 200);
  EXPECT_EQ(aligned.share(), 0);
}

TEST(AlignedTracks, AWeakViewKeepsTracksThatWouldHaveBeenComparedWithIt) {
  // The middle one of three shows something else; the outer two have tracks of their own.
  WallScene scene({-20, 20, 0});
  for (std::size_t i = 0; i < 100; ++i) {
    SparsePoint& point = scene.model.points[i];
    point.track.push_back({2, scene.exact(point, 2)});
  }
  cv::RNG noise(5);
  noise.fill(scene.images[2], cv::RNG::UNIFORM, 0, 255);
  const TrackAlignment aligned = align_tracks(scene.model, scene.images, {}, {}).value();
  EXPECT_GT(aligned.aligned, 80);
  EXPECT_GE(seen_by(aligned.model, 2), 95);
}

TEST(AlignedTracks, OptionsOutOfRangeAndCtrlCAreErrors) {
  const WallScene scene({0, 25});
  TrackAlignmentOptions options;
  options.patch.radius_px = -1;
  EXPECT_EQ(align_tracks(scene.model, scene.images, options, {}).error().kind, ErrorKind::usage);
  std::atomic<bool> cancel = true;
  Progress stopped;
  stopped.cancel = &cancel;
  EXPECT_EQ(align_tracks(scene.model, scene.images, {}, stopped).error().kind,
            ErrorKind::cancelled);
}

TEST(AlignedTracks, AnotherSurfaceIsNoPlaceOfTheTrack) {
  WallScene scene({0, 25});
  cv::RNG noise(3);
  noise.fill(scene.images[1], cv::RNG::UNIFORM, 0, 255);
  TrackAlignmentOptions options;
  options.min_aligned_a_view = 0;
  const TrackAlignment aligned = align_tracks(scene.model, scene.images, options, {}).value();
  EXPECT_EQ(aligned.aligned, 0);
  EXPECT_EQ(aligned.left_out, 200);
  EXPECT_TRUE(aligned.model.points.empty());
}

TEST(AlignedTracks, AViewThatWouldLoseItsHoldKeepsWhatItHad) {
  WallScene scene({0, 25});
  scene.images[1].setTo(128);
  const TrackAlignment aligned = align_tracks(scene.model, scene.images, {}, {}).value();
  EXPECT_EQ(aligned.aligned, 0);
  ASSERT_EQ(aligned.model.points.size(), 200u);
  EXPECT_EQ(aligned.model.points[5].track[1].pixel, scene.model.points[5].track[1].pixel);
}

TEST(AlignedTracks, NeitherNaNNorNothingIsAPlace) {
  WallScene scene({0, 25});
  scene.images[0].setTo(std::numeric_limits<float>::quiet_NaN());
  TrackAlignmentOptions options;
  options.min_aligned_a_view = 0;
  EXPECT_TRUE(align_tracks(scene.model, scene.images, options, {})->model.points.empty());
  scene.model.points.resize(1);
  scene.model.points[0].track.clear();
  EXPECT_TRUE(align_tracks(scene.model, scene.images, options, {})->model.points.empty());
  const Reconstruction none;
  EXPECT_TRUE(align_tracks(none, {}, options, {})->model.points.empty());
}

TEST(AlignedTracks, SmallerImagesGiveRecordedPixels) {
  WallScene scene({0, 25});
  for (cv::Mat& image : scene.images) cv::resize(image, image, {}, 0.5, 0.5, cv::INTER_AREA);
  const TrackAlignment aligned = align_tracks(scene.model, scene.images, {}, {}).value();
  EXPECT_GT(aligned.aligned, 50);
  EXPECT_LT(scene.rms_px(aligned.model, 1), 0.15);
}

TEST(AlignedTracks, TheSameOnAnyNumberOfThreads) {
  const WallScene scene({0, 25, -30});
  const int before = thread_count();
  set_thread_count(1);
  const TrackAlignment one = align_tracks(scene.model, scene.images, {}, {}).value();
  set_thread_count(4);
  const TrackAlignment four = align_tracks(scene.model, scene.images, {}, {}).value();
  set_thread_count(before);
  ASSERT_EQ(one.model.points.size(), four.model.points.size());
  for (std::size_t i = 0; i < one.model.points.size(); ++i) {
    ASSERT_EQ(one.model.points[i].track.size(), four.model.points[i].track.size());
    for (std::size_t k = 0; k < one.model.points[i].track.size(); ++k)
      EXPECT_EQ(one.model.points[i].track[k].pixel, four.model.points[i].track[k].pixel);
  }
}

TEST(PatchTemplate, NothingHoldsAConstantOrAnEdge) {
  cv::Mat constant(40, 40, CV_32F, cv::Scalar(1e6)), edge(40, 40, CV_32F, cv::Scalar(0));
  edge.colRange(20, 40).setTo(255);
  EXPECT_FALSE(PatchTemplate::at(constant, {20, 20}, {}));
  EXPECT_FALSE(PatchTemplate::at(edge, {20, 20}, {}));
  EXPECT_FALSE(PatchTemplate::at(edge, {2, 20}, {})) << "it leaves the image";
  EXPECT_FALSE(PatchTemplate::at(edge, {std::nan(""), 20}, {}));
}

TEST(PatchTemplate, SigmaIsInPixelsOfTheImageItIsFoundIn) {
  const PosedView view = view_at(0);
  const cv::Mat image = picture_of(view);
  cv::Mat larger;
  cv::resize(image, larger, {}, 2, 2, cv::INTER_CUBIC);
  const auto patch = PatchTemplate::at(image, {160, 120}, {});
  ASSERT_TRUE(patch);
  const auto same = patch->align(image, {{160.2, 120.1}, Eigen::Matrix2d::Identity()});
  const auto found = patch->align(larger, {{320.9, 240.7}, 2 * Eigen::Matrix2d::Identity()});
  ASSERT_TRUE(same && found);
  EXPECT_LT((found->place.centre - Eigen::Vector2d(320.5, 240.5)).norm(), 0.05);
  EXPECT_NEAR(found->sigma_px, 2 * same->sigma_px, 0.3 * same->sigma_px);
}

TEST(PatchTemplate, ScaleOfTheValuesChangesNothing) {
  const PosedView view = view_at(0);
  for (const double scale : {1e-6, 1.0, 1e6}) {
    const cv::Mat image = picture_of(view, scale);
    const auto patch = PatchTemplate::at(image, {160, 120}, {});
    ASSERT_TRUE(patch) << scale;
    const auto found = patch->align(image, {{160.7, 119.4}, Eigen::Matrix2d::Identity()});
    ASSERT_TRUE(found) << scale;
    EXPECT_LT((found->place.centre - Eigen::Vector2d(160, 120)).norm(), 0.02) << scale;
    EXPECT_GT(found->correlation, 0.999) << scale;
    EXPECT_LT(found->sigma_px, 0.02) << scale;
  }
}

}  // namespace
}  // namespace orbitfuse
