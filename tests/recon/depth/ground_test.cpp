// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "core/numeric/random.hpp"
#include "core/system/parallel.hpp"
#include "recon/depth/ground/extend_ground.hpp"
#include "recon/depth/ground/ground_plane.hpp"

namespace orbitfuse::depth {
namespace {

constexpr float none = std::numeric_limits<float>::quiet_NaN();
constexpr int view_count = 24;
constexpr float floor_height = -0.2f;
constexpr float texture_ends = 1.6f;  ///< what lies farther out is plain: nothing confirms it

/// What a pixel shows, and how far that is along the optical axis.
struct Shown {
  enum What { sky, ground, pillar, wall } what = sky;
  float z = std::numeric_limits<float>::infinity();
  float from_center = z;  ///< of the place
};

/// A pillar on a plain, seen from two loops; behind it, if asked for, a plain wall of half the
/// width.
struct Yard {
  std::vector<DepthView> views;
  std::vector<DepthMap> maps;
  std::vector<std::vector<Shown>> truth;
};

Shown looked_at(const Eigen::Vector3f& eye, const Eigen::Vector3f& ray, bool walled) {
  Shown shown;
  if (ray.z() < 0) shown = {Shown::ground, (floor_height - eye.z()) / ray.z()};
  // The pillar: a sphere on a stick would do as well.
  const Eigen::Vector2f from = eye.head<2>(), along = ray.head<2>();
  const float a = along.squaredNorm(), b = from.dot(along), c = from.squaredNorm() - 0.04f;
  if (b * b - a * c > 0) {
    const float t = (-b - std::sqrt(b * b - a * c)) / a, z = eye.z() + t * ray.z();
    if (t > 0 && z < 0.3f && z > floor_height && t < shown.z) shown = {Shown::pillar, t};
  }
  if (walled && ray.y() > 0) {
    const float t = (4 - eye.y()) / ray.y();
    const Eigen::Vector3f at = eye + t * ray;
    if (t > 0 && t < shown.z && std::abs(at.x()) < 2 && at.z() < 1.2f && at.z() > floor_height)
      shown = {Shown::wall, t};
  }
  return shown;
}

std::uint8_t gray_of(const Shown& shown, const Eigen::Vector3f& at) {
  switch (shown.what) {
    case Shown::sky:
      return 200;
    case Shown::pillar:
      return 60;
    case Shown::wall:
      return 170;
    case Shown::ground:
      break;
  }
  const float fade = at.head<2>().norm() < texture_ends ? 25.f : 0.f;
  return static_cast<std::uint8_t>(120 + fade * std::sin(9 * at.x()) * std::cos(8 * at.y()));
}

Yard yard(bool walled = false, float roll = 0) {
  Yard out;
  for (int i = 0; i < view_count; ++i) {
    const float azimuth = static_cast<float>(i % 12) * std::numbers::pi_v<float> / 6;
    const float height = i < 12 ? 0.1f : 0.5f;
    const Eigen::Vector3f eye(std::cos(azimuth), std::sin(azimuth), height);
    Eigen::Matrix3f axes;
    axes.col(2) = -eye.normalized();
    axes.col(0) = axes.col(2).cross(Eigen::Vector3f::UnitZ()).normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0));
    axes = axes * Eigen::AngleAxisf(roll, Eigen::Vector3f::UnitZ()).toRotationMatrix();
    DepthView view;
    view.camera = Camera::from_fov(120, 90, 60);
    view.gray.create(90, 120, CV_8UC1);
    view.world_rotation = axes.transpose();
    view.translation = -(axes.transpose() * eye);
    DepthMap map;
    map.view = i;
    map.camera = view.camera;
    map.depth = cv::Mat(90, 120, CV_32FC1, cv::Scalar(none));
    map.confidence = cv::Mat::zeros(90, 120, CV_32FC1);
    map.normal = cv::Mat::zeros(90, 120, CV_32FC3);
    std::vector<Shown> truth;
    for (int y = 0; y < 90; ++y)
      for (int x = 0; x < 120; ++x) {
        const Eigen::Vector3f ray = axes * view.camera.ray_of({x + 0.5, y + 0.5}).cast<float>();
        Shown shown = looked_at(eye, ray, walled);
        const Eigen::Vector3f at = eye + std::min(shown.z, 1e3f) * ray;
        shown.from_center = at.norm();
        view.gray.at<std::uint8_t>(y, x) = gray_of(shown, at);
        const bool confirmed = shown.what == Shown::pillar ||
                               (shown.what == Shown::ground && at.head<2>().norm() < texture_ends);
        if (confirmed) {
          const auto bits = random_bits(7, static_cast<std::uint64_t>(i),
                                        static_cast<std::uint64_t>(y * 120 + x));
          map.depth.at<float>(y, x) = shown.z * (1 + 0.002f * (uniform01(bits) - 0.5f));
          map.confidence.at<float>(y, x) = 0.7f;
        }
        truth.push_back(shown);
      }
    out.views.push_back(view);
    out.maps.push_back(map);
    out.truth.push_back(std::move(truth));
  }
  return out;
}

/// What became of the pixels that nothing confirmed.
struct Count {
  int ground = 0, ground_filled = 0, ground_wrong = 0;
  int sky = 0, sky_filled = 0;
  int others = 0, others_wrong = 0;
};

Count count(const Yard& before, const std::vector<DepthMap>& after, float far) {
  Count n;
  for (std::size_t i = 0; i < after.size(); ++i)
    for (int y = 0; y < 90; ++y)
      for (int x = 0; x < 120; ++x) {
        if (std::isfinite(before.maps[i].depth.at<float>(y, x))) continue;
        const Shown& truth = before.truth[i][static_cast<std::size_t>(y * 120 + x)];
        const float z = after[i].depth.at<float>(y, x);
        const bool filled = !std::isnan(z);
        if (truth.what == Shown::ground) {
          ++n.ground;
          n.ground_filled += filled;
          const float expected = truth.z * far / std::max(far, truth.from_center);
          n.ground_wrong += filled && !(std::abs(z / expected - 1) < 0.01f);
        } else if (truth.what == Shown::sky) {
          ++n.sky;
          n.sky_filled += filled;
          EXPECT_FALSE(filled && !std::isinf(z));
        } else {
          ++n.others;
          // The last row above the ground may be taken for it: it is as far away.
          n.others_wrong += filled && !(std::abs(z / truth.z - 1) < 0.05f);
        }
      }
  return n;
}

TEST(OpenGround, IsFoundUnderTheCameras) {
  const Yard scene = yard();
  const auto ground = find_ground(scene.views, scene.maps, 1);
  ASSERT_TRUE(ground) << ground.error().message();
  EXPECT_GT(ground->normal.z(), 0.9999);
  EXPECT_NEAR(ground->height, floor_height, 0.003);
}

TEST(OpenGround, IsNoneWhereNothingLiesUnderTheCameras) {
  Yard scene = yard();
  for (DepthMap& map : scene.maps) map.depth.setTo(none);
  EXPECT_FALSE(find_ground(scene.views, scene.maps, 1));
  EXPECT_FALSE(find_ground({}, {}, 1));
  // The pillar alone, and depths that are all alike: no plane that most of them lie on, or one that
  // stands upright.
  scene = yard();
  for (std::size_t i = 0; i < scene.maps.size(); ++i)
    for (int p = 0; p < 90 * 120; ++p)
      if (scene.truth[i][static_cast<std::size_t>(p)].what == Shown::ground)
        scene.maps[i].depth.at<float>(p / 120, p % 120) = none;
  EXPECT_FALSE(find_ground(scene.views, scene.maps, 1));
  for (DepthMap& map : scene.maps) map.depth.setTo(1.0f);
  EXPECT_FALSE(find_ground(scene.views, scene.maps, 1));
}

TEST(OpenGround, IsNotARoofWithTheYardBelowIt) {
  Yard scene = yard();
  // A third of the ground a hand's breadth lower than the rest: the upper part has much below it.
  for (DepthMap& map : scene.maps)
    for (int y = 0; y < 90; ++y)
      for (int x = 0; x < 40; ++x) map.depth.at<float>(y, x) *= 1.4f;
  const auto ground = find_ground(scene.views, scene.maps, 1);
  if (ground) {
    EXPECT_LT(ground->height, floor_height - 0.02f);
  }
}

TEST(ExtendedGround, ReachesTheHorizonAndLeavesTheSkyOpen) {
  for (const float roll : {0.f, 0.3f, std::numbers::pi_v<float> / 2}) {
    const Yard scene = yard(false, roll);
    const LevelPlane ground{Eigen::Vector3d::UnitZ(), static_cast<double>(floor_height)};
    std::vector<DepthMap> maps;
    for (const DepthMap& map : scene.maps) {
      maps.push_back(map);
      maps.back().depth = map.depth.clone();
      maps.back().confidence = map.confidence.clone();
      maps.back().normal = map.normal.clone();
    }
    const OpenSpace share = extend_over_ground(scene.views, ground, 12, maps);
    const Count n = count(scene, maps, 12);
    EXPECT_NEAR(share.ground, n.ground_filled / (view_count * 120.0 * 90), 1e-9);
    EXPECT_NEAR(share.sky, n.sky_filled / (view_count * 120.0 * 90), 1e-9);
    ASSERT_GT(n.ground, 1000);
    ASSERT_GT(n.sky, 1000);
    // The rest has no witness: the pillar hides it from the neighbours, or their frames end.
    const double least = 0.25;
    EXPECT_GT(n.ground_filled, least * n.ground) << roll;
    EXPECT_EQ(n.ground_wrong, 0) << roll;
    EXPECT_GT(n.sky_filled, least * n.sky) << roll;
  }
}

TEST(ExtendedGround, StopsAtWallsThatNothingConfirms) {
  const Yard scene = yard(true);
  std::vector<DepthMap> maps;
  for (const DepthMap& map : scene.maps) {
    maps.push_back(map);
    maps.back().depth = map.depth.clone();
  }
  const LevelPlane ground{Eigen::Vector3d::UnitZ(), static_cast<double>(floor_height)};
  extend_over_ground(scene.views, ground, 12, maps);
  const Count n = count(scene, maps, 12);
  ASSERT_GT(n.others, 1000);
  EXPECT_LT(n.others_wrong, 0.005 * n.others);
  EXPECT_EQ(n.ground_wrong, 0);
}

TEST(ExtendedGround, IsTheSameForAnyNumberOfThreads) {
  const Yard scene = yard(true);
  const LevelPlane ground{Eigen::Vector3d::UnitZ(), static_cast<double>(floor_height)};
  std::vector<cv::Mat> first;
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    std::vector<DepthMap> maps;
    for (const DepthMap& map : scene.maps) {
      maps.push_back(map);
      maps.back().depth = map.depth.clone();
    }
    extend_over_ground(scene.views, ground, 12, maps);
    for (std::size_t i = 0; i < maps.size(); ++i) {
      if (threads == 1)
        first.push_back(maps[i].depth.clone());
      else
        EXPECT_EQ(std::memcmp(first[i].data, maps[i].depth.data, 90 * 120 * sizeof(float)), 0) << i;
    }
  }
  set_thread_count(0);
}

TEST(ExtendedGround, LeavesMapsWithoutAnyConfirmedGroundAlone) {
  Yard scene = yard();
  for (DepthMap& map : scene.maps) map.depth.setTo(none);
  const LevelPlane ground{Eigen::Vector3d::UnitZ(), static_cast<double>(floor_height)};
  extend_over_ground(scene.views, ground, 12, scene.maps);
  for (const DepthMap& map : scene.maps)
    for (const float z : cv::Mat_<float>(map.depth)) EXPECT_FALSE(std::isfinite(z));
  std::vector<DepthMap> nothing;
  EXPECT_EQ(extend_over_ground({}, ground, 12, nothing).ground, 0);
}

}  // namespace
}  // namespace orbitfuse::depth
