// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/world_frame.hpp"

#include <gtest/gtest.h>

#include "core/geometry/level_cameras.hpp"
#include "core/numeric/angle_units.hpp"
#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

Similarity3d some_world() {
  return {7.0,
          Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized())),
          {100, -30, 4}};
}

TEST(WorldFrame, CanonicalIsZUpCentredAndOfUnitRadius) {
  Reconstruction model;
  model.views = testing_orbit::two_loops();
  move_world(model, some_world());
  EXPECT_LT(
      (look_at_point(cameras_of(model.views)) - some_world() * Eigen::Vector3d::Zero()).norm(),
      1e-3);
  const Similarity3d canonical = canonical_from_world(model.views, {});
  move_world(model, canonical);
  for (const PosedView& view : model.views) {
    const OrbitAngles angles = orbit_angles(camera_center(view.cam_from_world));
    EXPECT_NEAR(angles.radius, 1.0, 1e-3);
    EXPECT_NEAR(angles.elevation_deg, &view - model.views.data() < 12 ? 14 : 34, 0.2);
  }
}

TEST(WorldFrame, CamerasHeldOnTheirSideStandUprightInTheSameWorld) {
  for (const double turn_deg : {90.0, -90.0}) {
    Reconstruction model;
    model.views = testing_orbit::two_loops();
    const Eigen::AngleAxisd roll(turn_deg / degrees_per_radian, Eigen::Vector3d::UnitZ());
    for (PosedView& view : model.views)
      view.cam_from_world =
          Rigid3d{Eigen::Quaterniond(roll), Eigen::Vector3d::Zero()} * view.cam_from_world;
    move_world(model, some_world());
    move_world(model, canonical_from_world(model.views, {}));
    for (const PosedView& view : model.views)
      EXPECT_NEAR(orbit_angles(camera_center(view.cam_from_world)).elevation_deg,
                  &view - model.views.data() < 12 ? 14 : 34, 0.2)
          << turn_deg;
  }
}

TEST(WorldFrame, FewerThanTwoViewsKeepTheirWorld) {
  const Similarity3d none = canonical_from_world({}, {});
  EXPECT_EQ(none.scale, 1.0);
  EXPECT_EQ(none.translation, Eigen::Vector3d::Zero());
}

TEST(WorldFrame, StationsOfAMergedFrontAndBackContradictThePoses) {
  Session session;
  std::vector<PosedView> views = testing_orbit::two_loops();
  for (int i = 0; i < 24; ++i) {
    FrameRecord frame;
    frame.file = views[static_cast<std::size_t>(i)].name;
    Station station;
    station.loop = i / 12, station.index = i % 12, station.azimuth_deg = 30.0 * (i % 12);
    frame.station = station;
    session.frames.push_back(frame);
  }
  const StationFit good = fit_stations(views, session).value();
  EXPECT_EQ(good.views, 24);
  EXPECT_FALSE(good.mirrored);
  EXPECT_LT(good.worst_residual_deg, 10);
  EXPECT_EQ(good.outliers, 0);
  // A third of the views turned to the other side, as a near-symmetric object does to SfM.
  for (std::size_t i = 0; i < 8; ++i) {
    const Rigid3d half_turn{
        Eigen::Quaterniond(Eigen::AngleAxisd(3.14159265, Eigen::Vector3d::UnitZ())),
        Eigen::Vector3d::Zero()};
    views[i].cam_from_world = views[i].cam_from_world * half_turn;
  }
  EXPECT_GE(fit_stations(views, session).value().outliers, 8);
}

TEST(WorldFrame, ClockwiseStationsAreNoticed) {
  Session session;
  const std::vector<PosedView> views = testing_orbit::two_loops();
  for (int i = 0; i < 24; ++i) {
    FrameRecord frame;
    frame.file = views[static_cast<std::size_t>(i)].name;
    Station station;
    station.azimuth_deg = -30.0 * (i % 12);
    frame.station = station;
    session.frames.push_back(frame);
  }
  EXPECT_TRUE(fit_stations(views, session).value().mirrored);
  session.frames.resize(2);
  EXPECT_FALSE(fit_stations(views, session)) << "two stations fit any orbit";
}

}  // namespace
}  // namespace orbitfuse
