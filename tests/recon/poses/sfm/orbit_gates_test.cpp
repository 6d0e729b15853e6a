// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "recon/poses/sfm/sfm_ladder.hpp"
#include "recon/poses/world_frame.hpp"
#include "tests/recon/poses/feature_scene.hpp"
#include "tests/support/orbit_fixture.hpp"

// What COLMAP makes of thermal frames of the container: front and back of a near-symmetric object
// merged, at 0.8 px. The gates must refuse it without knowing the truth.
namespace orbitfuse {
namespace {

/// Frames every 10 deg in two loops, as a stream of tracking frames.
Session tracking_session(int count) {
  Session session;
  for (int i = 0; i < count; ++i) {
    FrameRecord frame;
    frame.modality = Modality::thermal;
    frame.device = "thermal0";
    frame.file = "track" + std::to_string(i);
    frame.sequence = static_cast<std::uint64_t>(i);
    frame.tracking = true;
    session.frames.push_back(frame);
  }
  return session;
}

template <class Fold>
ModalityPoses poses_with(const Session& session, const Fold& fold) {
  ModalityPoses poses;
  poses.frame_count = static_cast<int>(session.frames.size());
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    OrbitPose pose;
    pose.azimuth_deg = fold(10.0 * static_cast<double>(i % 36));
    pose.elevation_deg = i < 36 ? 10 : 32;
    pose.radius = 4;
    const Camera camera = testing_orbit::camera(1400);
    poses.reconstruction.views.push_back(
        {session.frames[i].file, camera, cam_from_world_of(pose, camera)});
  }
  poses.gates["reprojection_rms_proxy_px"] = 0.79;
  poses.gates["median_triangulation_deg"] = 10;
  return poses;
}

bool believed(ModalityPoses poses, const Session& session, std::string* why = nullptr) {
  std::string words;
  const bool passes = passes_gates(poses, session, {}, words);
  if (why != nullptr) *why = words;
  return passes;
}

double as_taken(double azimuth) { return azimuth + 3 * std::sin(azimuth); }
double front_on_back(double azimuth) { return std::fmod(as_taken(azimuth) + 360, 180); }
double mirrored_back(double azimuth) { return azimuth < 180 ? azimuth : 360 - azimuth; }

TEST(OrbitGates, AnOrbitInOrderIsBelieved) {
  for (const int count : {36, 72}) {
    const Session session = tracking_session(count);
    std::string why;
    EXPECT_TRUE(believed(poses_with(session, as_taken), session, &why)) << why;
  }
}

TEST(OrbitGates, FrontMergedWithBackIsRefusedByTheOrderOfTrackingFramesAlone) {
  for (const int count : {36, 72}) {
    const Session session = tracking_session(count);
    std::string why;
    EXPECT_FALSE(believed(poses_with(session, front_on_back), session, &why));
    EXPECT_NE(why.find("leaps"), std::string::npos) << why;
    EXPECT_FALSE(believed(poses_with(session, mirrored_back), session, &why));
    EXPECT_NE(why.find("turns back"), std::string::npos) << why;
  }
}

TEST(OrbitGates, FrontMergedWithBackIsRefusedByStationsOfUnknownOrigin) {
  Session session = tracking_session(36);
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    FrameRecord& frame = session.frames[i];
    frame.tracking = false;
    frame.sequence = 0;  // the stations alone must tell
    Station station;
    station.index = static_cast<int>(i);
    station.azimuth_deg = 10.0 * static_cast<double>(i);
    station.azimuth_sigma_deg.reset();
    frame.station = station;
  }
  EXPECT_TRUE(believed(poses_with(session, as_taken), session));
  const ModalityPoses merged = poses_with(session, front_on_back);
  EXPECT_FALSE(believed(merged, session));
  const auto fit = fit_stations(merged.reconstruction.views, session);
  ASSERT_TRUE(fit);
  EXPECT_GE(fit->outliers, 15) << "an unknown origin says nothing against differences";
}

/// Declared 15 degrees apart where they were taken 10 apart.
TEST(OrbitGates, OfStationsDeclaredWronglyTheOrderIsLeft) {
  Session session = tracking_session(36);
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    FrameRecord& frame = session.frames[i];
    frame.tracking = false;
    Station station;
    station.index = static_cast<int>(i);
    station.azimuth_deg = 15.0 * static_cast<double>(i);
    station.azimuth_sigma_deg.reset();
    frame.station = station;
  }
  const auto frames = session.frames_of(Modality::thermal);
  EXPECT_TRUE(have_declared_stations(frames));
  EXPECT_TRUE(all_have_stations(frames));
  const ModalityPoses right = poses_with(session, as_taken);
  EXPECT_FALSE(believed(right, session));
  const auto fit = fit_stations(right.reconstruction.views, session);
  ASSERT_TRUE(fit);
  EXPECT_TRUE(contradicted(*fit, {}));

  const Session ordered = in_order_alone(session, Modality::thermal);
  EXPECT_FALSE(have_declared_stations(ordered.frames_of(Modality::thermal)));
  EXPECT_FALSE(all_have_stations(ordered.frames_of(Modality::thermal)));
  EXPECT_FALSE(fit_stations(right.reconstruction.views, ordered));
  EXPECT_TRUE(believed(right, ordered));
  EXPECT_FALSE(believed(poses_with(ordered, front_on_back), ordered));
  EXPECT_FALSE(believed(poses_with(ordered, mirrored_back), ordered));
  EXPECT_TRUE(
      all_have_stations(in_order_alone(session, Modality::visible).frames_of(Modality::thermal)))
      << "the other modality keeps its own";
}

/// Two loops of 12 stations leap twice where front and back merge, which the order alone lets pass.
TEST(OrbitGates, AnotherSpacingIsEvenAndAFoldIsNot) {
  Session session = tracking_session(24);
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    FrameRecord& frame = session.frames[i];
    frame.tracking = false;
    frame.station.emplace();
    frame.station->index = static_cast<int>(i);  // declared as one loop
    // Upright and broad photos are counted each from 0, as those of two cameras.
    frame.sequence = i / 2;
  }
  const auto at = [&](const auto& azimuth_at) {
    ModalityPoses poses;
    for (std::size_t i = 0; i < session.frames.size(); ++i) {
      OrbitPose pose;
      pose.azimuth_deg = azimuth_at(i);
      pose.elevation_deg = i < 12 ? 10 : 32;
      pose.radius = 4;
      const Camera camera = testing_orbit::camera(1400);
      poses.reconstruction.views.push_back(
          {session.frames[i].file, camera, cam_from_world_of(pose, camera)});
    }
    return even_spacing(poses.reconstruction.views, session).value();
  };
  const auto even = [&](const auto& azimuth_of) {
    return at([&](std::size_t i) { return azimuth_of(30.0 * static_cast<double>(i % 12)); });
  };
  const auto astray = [&](const auto& azimuth_of) { return even(azimuth_of).astray; };
  EXPECT_TRUE(astray(as_taken).empty());
  EXPECT_NEAR(even(as_taken).spacing_deg, 30, 0.3);
  const EvenSpacing back = even([](double a) { return -as_taken(a); });
  EXPECT_TRUE(back.astray.empty()) << "walked the other way";
  EXPECT_NEAR(back.spacing_deg, -30, 0.3);
  const auto aside = [](std::size_t i) {
    return 30.0 * static_cast<double>(i) + (i < 12 ? 0 : 12);
  };
  EXPECT_NEAR(at(aside).spacing_deg, 30, 0.01) << "the second loop begins aside of the first";
  const auto open = [](std::size_t i) { return 25.0 * static_cast<double>(i); };
  EXPECT_NEAR(at(open).spacing_deg, 25, 0.11) << "no closed loop";
  const std::size_t many = static_cast<std::size_t>(max_contradicting * 24) + 1;
  EXPECT_GE(astray(front_on_back).size(), many);
  EXPECT_GE(astray(mirrored_back).size(), many);
  EXPECT_GE(astray([](double a) { return std::fmod(a, 90); }).size(), many);
  const auto one_folded = astray([](double a) { return a == 60 ? a + 180 : a; });
  EXPECT_EQ(one_folded, (std::vector{session.frames[2].file, session.frames[14].file}));
}

TEST(OrbitGates, StationsAtAnotherSpacingMakeTheLoopsThatItMakes) {
  Session session = tracking_session(24);
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    session.frames[i].tracking = false;
    Station& station = session.frames[i].station.emplace();
    station.loop = static_cast<int>(i / 18), station.index = static_cast<int>(i % 18);
    station.azimuth_deg = 20 * station.index;
  }
  const auto frames = session.frames_of(Modality::thermal);
  EXPECT_DOUBLE_EQ(station_spacing_deg(frames).value(), 20);
  EXPECT_FALSE(station_spacing_deg({frames[0]}));
  const Session respaced = at_spacing(session, Modality::thermal, 29.9);
  for (std::size_t i = 0; i < 24; ++i) {
    EXPECT_EQ(respaced.frames[i].station->loop, static_cast<int>(i / 12));
    EXPECT_DOUBLE_EQ(respaced.frames[i].station->azimuth_deg, 29.9 * static_cast<double>(i % 12));
  }
  EXPECT_EQ(at_spacing(session, Modality::visible, 29.9).frames[5].station->azimuth_deg, 100)
      << "the other modality keeps its own";
}

TEST(OrbitGates, APartOfTheFramesIsNotEnough) {
  // 45 of 72, as measured: a right model of so few would be refused as well.
  const Session session = tracking_session(72);
  ModalityPoses poses = poses_with(session, as_taken);
  poses.reconstruction.views.resize(45);
  EXPECT_FALSE(believed(poses, session));
}

TEST(OrbitGates, PhotosWithoutStationsHaveNoOrderToContradict) {
  Session session = tracking_session(36);
  for (FrameRecord& frame : session.frames) frame.tracking = false;
  const ModalityPoses poses =
      poses_with(session, [](double a) { return std::fmod(a * 7.3, 360.0); });
  EXPECT_EQ(capture_order(poses.reconstruction.views, session).steps, 0);
  EXPECT_TRUE(believed(poses, session));
}

TEST(OrbitGates, ViewsFoldedOntoTheOtherSideAreDroppedByName) {
  testing_orbit::FeatureSceneOptions options;
  options.wrong_pillar = options.false_matches = 0;
  const auto scene = testing_orbit::FeatureSceneMaker(options).make();
  PosedFrames posed{FramePoses(24), scene.graph.cameras};
  for (std::size_t v = 0; v < 24; ++v) posed.poses[v] = scene.truth[v].cam_from_world;
  Reconstruction model = reconstruction_of(
      scene.graph, posed, triangulate_tracks(scene.graph, scene.graph.proposed, posed, {}),
      Modality::visible);
  const auto judged = [&] {
    return judge_model(model, scene.session, scene.session.frames_of(Modality::visible), {});
  };
  const auto whole = judged();
  ASSERT_TRUE(whole && whole->believed) << whole->why;
  EXPECT_TRUE(whole->poses.dropped.empty());

  // Each stands where the other was seen, so all its matches agree.
  std::swap(model.views[4].name, model.views[10].name);
  const auto rest = judged();
  ASSERT_TRUE(rest) << rest.error().message();
  EXPECT_TRUE(rest->believed) << rest->why;
  EXPECT_EQ(rest->poses.reconstruction.views.size(), 22u);
  ASSERT_EQ(rest->poses.dropped.size(), 2u);
  for (const DroppedView& view : rest->poses.dropped) {
    EXPECT_TRUE(view.name == scene.truth[4].name || view.name == scene.truth[10].name);
    EXPECT_NE(view.why.find("station"), std::string::npos);
  }

  // A fifth of all folded: nothing of the model is believed.
  for (const std::size_t v : {0u, 1u, 14u}) std::swap(model.views[v].name, model.views[v + 6].name);
  const auto none = judged();
  ASSERT_FALSE(none) << none->why;
  EXPECT_NE(none.error().found.find("another side"), std::string::npos) << none.error().message();
}

}  // namespace
}  // namespace orbitfuse
