// SPDX-License-Identifier: BSD-3-Clause
#include "app/recording/camera_spec.hpp"

#include <gtest/gtest.h>

#include "app/recording/open_cameras.hpp"

namespace orbitfuse::recording {
namespace {

TEST(CameraSpec, NamesMayHoldColons) {
  const auto spec = parse_camera_spec("v4l2:id:046d:0825,size=1280x720,rate=15");
  ASSERT_TRUE(spec) << spec.error().message();
  EXPECT_EQ(spec->driver, "v4l2");
  EXPECT_EQ(spec->camera, "id:046d:0825");
  EXPECT_EQ(size(*spec, {})->width, 1280);
  EXPECT_EQ(*number(*spec, "rate", 0), 15);
  EXPECT_TRUE(parse_camera_spec("aravis")->camera.empty());
}

TEST(CameraSpec, MistakesNameWhatExists) {
  const auto message = [](const char* text) { return parse_camera_spec(text).error().message(); };
  EXPECT_NE(message("gige:1.2.3.4").find("aravis"), std::string::npos);
  EXPECT_NE(message("v4l2:/dev/video0,rat=15").find("rate"), std::string::npos);
  EXPECT_NE(message("replay:x,speed").find("key=value"), std::string::npos);
  EXPECT_EQ(parse_camera_spec("").error().kind, ErrorKind::usage);
  for (const char* bad :
       {"v4l2,size=1280", "v4l2,size=ax7", "v4l2,size=0x0", "v4l2,size=1e9x1e9"}) {
    EXPECT_FALSE(size(*parse_camera_spec(bad), {})) << bad;
  }
  for (const char* bad : {"v4l2,rate=fast", "v4l2,rate=-1", "v4l2,rate=nan", "v4l2,rate=15Hz"}) {
    EXPECT_FALSE(number(*parse_camera_spec(bad), "rate", 0)) << bad;
  }
}

TEST(OpenCameras, WhatCannotBeOpenedIsSaidBeforeAnythingRuns) {
  Cameras cameras;
  const auto add = [&](const char* text) {
    return add_cameras(*parse_camera_spec(text), Modality::thermal, {}, cameras);
  };
  EXPECT_EQ(add("replay:/does/not/exist").error().kind, ErrorKind::input);
  EXPECT_NE(add("replay").error().message().find("replay:SESSION_FOLDER"), std::string::npos);
  EXPECT_EQ(add("v4l2:video0").error().kind, ErrorKind::usage);
  const Status profile = add("aravis,profile=flir-t1000");
  ASSERT_FALSE(profile);
  EXPECT_NE(profile.error().remedy.find("flir-ax5"), std::string::npos)
      << profile.error().message();
  EXPECT_FALSE(add("synthetic,spacing=31"));
  EXPECT_TRUE(cameras.sources.empty());
}

TEST(OpenCameras, AddressesOfPhonesMayHoldAnythingAndAreForPhotosOnly) {
  const auto spec = parse_camera_spec("network:rtsp://me:secret@10.0.0.7:554/s?a=b,c=d");
  ASSERT_TRUE(spec) << spec.error().message();
  EXPECT_EQ(spec->camera, "rtsp://me:secret@10.0.0.7:554/s?a=b,c=d");
  EXPECT_TRUE(spec->settings.empty());
  Cameras cameras;
  EXPECT_EQ(add_cameras(*spec, Modality::thermal, {}, cameras).error().kind, ErrorKind::usage);
  for (const char* bad : {"network", "network:/dev/video0", "network:http://", "network:file:///x"})
    EXPECT_EQ(add_cameras(*parse_camera_spec(bad), Modality::visible, {}, cameras).error().kind,
              ErrorKind::usage)
        << bad;
  EXPECT_TRUE(cameras.sources.empty());
  ASSERT_TRUE(add_cameras(*spec, Modality::visible, {}, cameras));
  EXPECT_TRUE(cameras.live);
  EXPECT_EQ(cameras.sources.at(0)->describe().serial, "rtsp://10.0.0.7:554/s");
}

TEST(OpenCameras, ControlsOfAVideoCameraAreChecked) {
  Cameras cameras;
  const auto add = [&](const std::string& settings) {
    return add_cameras(*parse_camera_spec("v4l2:/dev/video0," + settings), Modality::visible, {},
                       cameras);
  };
  for (const char* bad : {"exposure=fast", "exposure=0", "exposure=0.01", "focus=-1",
                          "white-balance=1e30", "lock=maybe"}) {
    const Status status = add(bad);
    ASSERT_FALSE(status) << bad;
    EXPECT_EQ(status.error().kind, ErrorKind::usage) << bad;
  }
  EXPECT_TRUE(add("exposure=8.5,focus=0,white-balance=4500,lock=no"));
  EXPECT_EQ(cameras.sources.size(), 1u);
}

TEST(OpenCameras, ReplayKnowsTheLoopsOfItsStations) {
  Cameras cameras;
  const auto spec =
      parse_camera_spec(std::string("replay:") + ORBITFUSE_SOURCE_DIR "/replay_data/car");
  ASSERT_TRUE(add_cameras(*spec, Modality::visible, {}, cameras));
  ASSERT_TRUE(cameras.plan);
  EXPECT_EQ(cameras.plan->sectors_per_loop(), 12);
  EXPECT_EQ(cameras.plan->loop_elevations_deg.size(), 2u);
  EXPECT_FALSE(cameras.live);
}

}  // namespace
}  // namespace orbitfuse::recording
