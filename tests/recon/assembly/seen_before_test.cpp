// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/seen_before.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace orbitfuse {
namespace {

/// Looks at the origin from there.
PosedView from(const Eigen::Vector3d& eye) {
  const Eigen::Vector3d z = -eye.normalized(), x = z.cross(Eigen::Vector3d::UnitY()).normalized();
  Eigen::Matrix3d r;
  r << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond q(r);
  return {"v", Camera::from_fov(80, 60, 50), {q, -(q * eye)}};
}

PosedView on_ring(double azimuth_deg, double radius) {
  const double a = azimuth_deg * std::numbers::pi / 180;
  return from(radius * Eigen::Vector3d(std::cos(a), std::sin(a), 0));
}

std::vector<PosedView> ring(double last_deg) {
  std::vector<PosedView> views;
  for (double a = 0; a < last_deg; a += 30) views.push_back(on_ring(a, 4));
  return views;
}

/// A hollow unit sphere, which a field's surface is: from within one sees its other side.
Result<SceneRender> shell(const Camera& camera, const Rigid3d& cam_from_world) {
  SceneRender seen{{}, cv::Mat1f(camera.height, camera.width)};
  const Eigen::Vector3d origin = camera_center(cam_from_world);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d d =
          cam_from_world.rotation.conjugate() * camera.ray_of({x + 0.5, y + 0.5});
      const double a = d.squaredNorm(), b = origin.dot(d), c = origin.squaredNorm() - 1;
      const double root = std::sqrt(b * b - a * c);  // NaN: no hit
      const double z = (-b - root) / a > 0 ? (-b - root) / a : (-b + root) / a;
      seen.depth.at<float>(y, x) =
          z > 0 ? static_cast<float>(z) : std::numeric_limits<float>::quiet_NaN();
    }
  return seen;
}

SeenOfView share(const SeenBefore& recorded, const PosedView& view) {
  return recorded.share_of(view, shell(view.camera, view.cam_from_world)->depth);
}

TEST(SeenBefore, TellsWhatRecordedViewsSawFromWhatTheyDidNot) {
  const auto recorded = SeenBefore::of(shell, ring(360));
  ASSERT_TRUE(recorded);
  for (const double radius : {2.5, 4.0, 9.0}) {
    const SeenOfView between = share(*recorded, on_ring(15, radius));
    EXPECT_GT(between.surface, 0.05) << radius;
    EXPECT_GT(between.seen, 0.95) << radius;
  }
  EXPECT_LT(share(*recorded, on_ring(15, 0.3)).seen, 0.05) << "from within";
  PosedView away = on_ring(15, 4);
  away.cam_from_world.rotation =
      Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()) * away.cam_from_world.rotation;
  away.cam_from_world.translation =
      -(away.cam_from_world.rotation * camera_center(on_ring(15, 4).cam_from_world));
  EXPECT_EQ(share(*recorded, away).surface, 0);
  EXPECT_EQ(share(*recorded, away).seen, 0);
}

TEST(SeenBefore, OfAHalfOrbitTheOtherSideIsUnseen) {
  const auto recorded = SeenBefore::of(shell, ring(180));
  ASSERT_TRUE(recorded);
  EXPECT_GT(share(*recorded, on_ring(75, 4)).seen, 0.95);
  EXPECT_LT(share(*recorded, on_ring(255, 4)).seen, 0.2);
}

TEST(SeenBefore, WithoutViewsOrDepthNothingWasSeen) {
  const auto none = SeenBefore::of(shell, {});
  ASSERT_TRUE(none);
  EXPECT_EQ(share(*none, on_ring(0, 4)).seen, 0);
  const auto recorded = SeenBefore::of(shell, ring(360));
  for (const float depth : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    const SeenOfView seen = recorded->share_of(on_ring(0, 4), cv::Mat1f(60, 80, depth));
    EXPECT_EQ(seen.surface, 0) << depth;
    EXPECT_EQ(seen.seen, 0) << depth;
  }
}

TEST(SeenBefore, TheRenderersErrorIsHandedOn) {
  const SceneRenderer broken = [](const Camera&, const Rigid3d&) -> Result<SceneRender> {
    return fail(ErrorKind::cancelled, "render", "stopped", "");
  };
  const auto refused = SeenBefore::of(broken, ring(360));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace orbitfuse
