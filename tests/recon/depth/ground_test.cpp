// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>

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

enum class Wall {
  absent,
  behind,      ///< plain, of half the width, before the sky
  rim_known,   ///< the same, of the ground's gray, its upper edge confirmed
  foot_known,  ///< the same, its foot confirmed
  all_round    ///< a room's, plain and without an end above
};

/// A pillar on a plain, seen from two loops; behind it, if asked for, a wall.
struct Yard {
  std::vector<DepthView> views;
  std::vector<DepthMap> maps;
  std::vector<std::vector<Shown>> truth;
};

Shown looked_at(const Eigen::Vector3f& eye, const Eigen::Vector3f& ray, Wall wall) {
  Shown shown;
  if (ray.z() < 0) shown = {Shown::ground, (floor_height - eye.z()) / ray.z()};
  // The pillar: a sphere on a stick would do as well.
  const Eigen::Vector2f from = eye.head<2>(), along = ray.head<2>();
  const float a = along.squaredNorm(), b = from.dot(along), c = from.squaredNorm() - 0.04f;
  if (b * b - a * c > 0) {
    const float t = (-b - std::sqrt(b * b - a * c)) / a, z = eye.z() + t * ray.z();
    if (t > 0 && z < 0.3f && z > floor_height && t < shown.z) shown = {Shown::pillar, t};
  }
  if (wall == Wall::all_round)
    for (const float side : {-2.5f, 2.5f})
      for (const int axis : {0, 1})
        if (const float t = (side - eye[axis]) / ray[axis]; t > 0 && t < shown.z)
          shown = {Shown::wall, t};
  if (wall != Wall::absent && wall != Wall::all_round && ray.y() > 0) {
    const float t = (4 - eye.y()) / ray.y();
    const Eigen::Vector3f at = eye + t * ray;
    if (t > 0 && t < shown.z && std::abs(at.x()) < 2 && at.z() < 1.2f && at.z() > floor_height)
      shown = {Shown::wall, t};
  }
  return shown;
}

std::uint8_t gray_of(const Shown& shown, const Eigen::Vector3f& at, Wall wall) {
  switch (shown.what) {
    case Shown::sky:
      return 200;
    case Shown::pillar:
      return 60;
    case Shown::wall:
      return wall == Wall::rim_known || wall == Wall::foot_known ? 120 : 170;
    case Shown::ground:
      break;
  }
  const float fade = at.head<2>().norm() < texture_ends ? 25.f : 0.f;
  return static_cast<std::uint8_t>(120 + fade * std::sin(9 * at.x()) * std::cos(8 * at.y()));
}

Yard yard(Wall wall = Wall::absent, float roll = 0) {
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
        Shown shown = looked_at(eye, ray, wall);
        const Eigen::Vector3f at = eye + std::min(shown.z, 1e3f) * ray;
        shown.from_center = at.norm();
        view.gray.at<std::uint8_t>(y, x) = gray_of(shown, at, wall);
        const bool known_wall =
            shown.what == Shown::wall && ((wall == Wall::rim_known && at.z() > 1) ||
                                          (wall == Wall::foot_known && at.z() < -0.1f));
        const bool confirmed = shown.what == Shown::pillar || known_wall ||
                               (shown.what == Shown::ground && at.head<2>().norm() < texture_ends);
        if (confirmed) {
          const auto bits = random_bits(7, static_cast<std::uint64_t>(i),
                                        static_cast<std::uint64_t>(y * 120 + x));
          map.depth.at<float>(y, x) = shown.z * (1 + 0.002f * (uniform01(bits) - 0.5f));
          map.confidence.at<float>(y, x) = 0.7f;
          const Eigen::Vector3f normal =
              view.world_rotation * (shown.what == Shown::ground ? Eigen::Vector3f::UnitZ().eval()
                                                                 : (-eye.normalized()).eval());
          map.normal.at<cv::Vec3f>(y, x) = {normal.x(), normal.y(), normal.z()};
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
  EXPECT_FALSE(find_ground(scene.views, scene.maps, 1));
}

TEST(OpenGround, IsNotATableThatEndsBeforeTheCameras) {
  Yard scene = yard();
  for (std::size_t i = 0; i < scene.maps.size(); ++i)
    for (int p = 0; p < 90 * 120; ++p)
      if (const Shown& shown = scene.truth[i][static_cast<std::size_t>(p)];
          shown.what == Shown::ground && shown.from_center > 0.7f)
        scene.maps[i].depth.at<float>(p / 120, p % 120) = none;
  const auto ground = find_ground(scene.views, scene.maps, 1);
  ASSERT_FALSE(ground);
  EXPECT_NE(ground.error().found.find("as a table would"), std::string::npos)
      << ground.error().found;
}

TEST(OpenGround, IsFoundFromAThirdOfAnOrbitAndFromRolledViews) {
  Yard scene = yard(Wall::absent, 0.3f);
  EXPECT_TRUE(find_ground(scene.views, scene.maps, 1));
  std::vector<DepthView> views;
  std::vector<DepthMap> maps;
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    if (i % 12 < 4) views.push_back(scene.views[i]), maps.push_back(scene.maps[i]);
  const auto ground = find_ground(views, maps, 1);
  ASSERT_TRUE(ground) << ground.error().message();
  EXPECT_NEAR(ground->height, floor_height, 0.003);
}

TEST(OpenGround, NeedsViewsThatAgreeAboutWhatIsUp) {
  Yard scene = yard();
  for (std::size_t i = 0; i < scene.views.size(); i += 2) {
    // Held upside down: the same rays, other axes.
    const Eigen::Matrix3f turn = Eigen::Vector3f(-1, -1, 1).asDiagonal();
    scene.views[i].world_rotation = turn * scene.views[i].world_rotation;
    scene.views[i].translation = turn * scene.views[i].translation;
    cv::rotate(scene.maps[i].depth, scene.maps[i].depth, cv::ROTATE_180);
  }
  EXPECT_FALSE(find_ground(scene.views, scene.maps, 1));
}

TEST(ExtendedGround, ReachesTheHorizonAndLeavesTheSkyOpen) {
  for (const float roll : {0.f, 0.3f, std::numbers::pi_v<float> / 2}) {
    const Yard scene = yard(Wall::absent, roll);
    const LevelPlane ground{Eigen::Vector3d::UnitZ(), static_cast<double>(floor_height)};
    std::vector<DepthMap> maps;
    for (const DepthMap& map : scene.maps) {
      maps.push_back(map);
      maps.back().depth = map.depth.clone();
      maps.back().confidence = map.confidence.clone();
      maps.back().normal = map.normal.clone();
    }
    const OpenSpace share = extend_over_ground(scene.views, ground, {}, 12, maps);
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

Count extended(const Yard& scene, const std::vector<Eigen::Vector3f>& points = {}) {
  std::vector<DepthMap> maps;
  for (const DepthMap& map : scene.maps) {
    maps.push_back(map);
    maps.back().depth = map.depth.clone();
  }
  const LevelPlane ground{Eigen::Vector3d::UnitZ(), static_cast<double>(floor_height)};
  extend_over_ground(scene.views, ground, points, 12, maps);
  return count(scene, maps, 12);
}

TEST(ExtendedGround, StopsAtWallsThatNothingConfirms) {
  const Count n = extended(yard(Wall::behind));
  ASSERT_GT(n.others, 1000);
  EXPECT_LT(n.others_wrong, 0.005 * n.others);
  EXPECT_EQ(n.ground_wrong, 0);
}

TEST(ExtendedGround, IsNotABodyOfItsGrayWhoseEdgeIsKnownAboveIt) {
  const Count n = extended(yard(Wall::rim_known));
  ASSERT_GT(n.others, 1000);
  EXPECT_LT(n.others_wrong, 0.015 * n.others);
}

TEST(ExtendedGround, IsNotAWallOfItsGrayWhoseFootLiesInThePlane) {
  const Count n = extended(yard(Wall::foot_known));
  ASSERT_GT(n.others, 1000);
  EXPECT_LT(n.others_wrong, 0.01 * n.others);
}

TEST(ExtendedGround, TakesNoWallOfARoomForTheSky) {
  const Count n = extended(yard(Wall::all_round));
  ASSERT_GT(n.others, 10000);
  // Where the pillar stands before the wall's foot, nothing says that the wall has one: 3.6 %.
  EXPECT_LT(n.others_wrong, 0.04 * n.others);
}

TEST(ExtendedGround, LeavesWhatSparsePointsStandBefore) {
  const Yard scene = yard();
  const Count open = extended(scene);
  // A screen of points all round, that no depth map shows.
  std::vector<Eigen::Vector3f> points;
  for (int a = 0; a < 720; ++a)
    for (int z = -15; z < 100; ++z)
      points.emplace_back(2.5f * std::cos(static_cast<float>(a) * std::numbers::pi_v<float> / 360),
                          2.5f * std::sin(static_cast<float>(a) * std::numbers::pi_v<float> / 360),
                          0.02f * static_cast<float>(z));
  const Count screened = extended(scene, points);
  EXPECT_GT(open.sky_filled, 1000);
  EXPECT_LT(screened.sky_filled, open.sky_filled / 20);
  EXPECT_LT(screened.ground_filled, open.ground_filled);
}

TEST(ExtendedGround, SeesNoFurtherThanItsImage) {
  // What lies behind the image in memory (DepthView::gray) is not looked at.
  const Yard plain = yard();
  Yard padded = yard();
  for (DepthView& view : padded.views) {
    cv::Mat larger(view.gray.rows + 2, view.gray.cols, CV_8UC1, cv::Scalar(0));
    view.gray.copyTo(larger.rowRange(0, view.gray.rows));
    view.gray = larger.rowRange(0, view.gray.rows);
  }
  const Count n = extended(plain), m = extended(padded);
  EXPECT_EQ(n.ground_filled, m.ground_filled);
  EXPECT_EQ(n.sky_filled, m.sky_filled);
}

TEST(ExtendedGround, IsTheSameForAnyNumberOfThreads) {
  const Yard scene = yard(Wall::behind);
  const LevelPlane ground{Eigen::Vector3d::UnitZ(), static_cast<double>(floor_height)};
  std::vector<cv::Mat> first;
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    std::vector<DepthMap> maps;
    for (const DepthMap& map : scene.maps) {
      maps.push_back(map);
      maps.back().depth = map.depth.clone();
    }
    extend_over_ground(scene.views, ground, {}, 12, maps);
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
  extend_over_ground(scene.views, ground, {}, 12, scene.maps);
  for (const DepthMap& map : scene.maps)
    for (const float z : cv::Mat_<float>(map.depth)) EXPECT_FALSE(std::isfinite(z));
  std::vector<DepthMap> nothing;
  EXPECT_EQ(extend_over_ground({}, ground, {}, 12, nothing).ground, 0);
}

}  // namespace
}  // namespace orbitfuse::depth
