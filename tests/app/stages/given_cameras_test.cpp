// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/given_cameras.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/stages/unseen_views.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::stages {
namespace {
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct GivenCamerasFile : ::testing::Test {
  Result<GivenCameras> read(const std::vector<std::string>& files, int width = 80,
                            int height = 60) {
    json frames = json::array();
    for (const std::string& name : files)
      frames.push_back(
          {{"file_path", name},
           {"transform_matrix", {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}});
    const auto file = temp / "cameras.json";
    test::put(file,
              json{{"w", width}, {"h", height}, {"fl_x", std::max(70, width)}, {"frames", frames}}
                  .dump());
    return read_given_cameras(file.string());
  }
  std::vector<std::string> names(const std::vector<std::string>& files) {
    std::vector<std::string> list;
    const GivenCameras given = read(files).value();
    for (const PosedView& view : given.views.views) list.push_back(view.name);
    return list;
  }
  const test::TempFolder temp;
};

TEST_F(GivenCamerasFile, ViewsAreCalledAsTheirFilesAre) {
  EXPECT_THAT(names({"images/front.png", "images/back.png"}), ElementsAre("front", "back"));
  EXPECT_THAT(names({"a/front.png", "b/front.png"}), ElementsAre("000", "001"));
  EXPECT_THAT(names({"a/front.png", "b/.png\n"}), ElementsAre("000", "001"));
  for (const char* number : {"1", "-2.5", "nan", "inf", "1e999"})
    EXPECT_THAT(names({"front.png", std::string(number) + ".png"}), ElementsAre("000", "001"))
        << number;
  EXPECT_THAT(read({"a/front.png", "b/front.png"})->files,
              ElementsAre("a/front.png", "b/front.png"));
}

TEST_F(GivenCamerasFile, WhatCanNotBeRenderedIsNamed) {
  EXPECT_THAT(read({"a.png"}, 2'000'000).error().message(), HasSubstr("2000000 x 60 pixels"));
  EXPECT_THAT(read({"a.png"}, -5).error().message(), HasSubstr("-5 x 60 pixels"));
  EXPECT_THAT(read({"a.png", "b.png"}, 20'000, 20'000).error().message(),
              HasSubstr("frames[0]: 20000x20000 pixels"));
  EXPECT_THAT(read_given_cameras((temp / "none.json").string()).error().message(),
              HasSubstr("--path auto"));
}

/// A plane across the whole picture, one unit off.
SeenBefore plane_seen_by(const PosedView& view) {
  return SeenBefore::of(
             [](const Camera& camera, const Rigid3d&) -> Result<SceneRender> {
               return SceneRender{{}, cv::Mat1f(camera.height, camera.width, 1.0F)};
             },
             {view})
      .value();
}

TEST(UnseenViews, AreNamedWithTheFrameThatCamerasAreTakenIn) {
  const PosedView recorded{"r", Camera::from_fov(80, 60, 50), {}};
  PosedView aside = recorded;
  aside.name = "aside";
  aside.cam_from_world.translation.x() = 5;
  PosedView same = recorded;
  same.name = "same";
  const cv::Mat1f plane(60, 80, 1.0F), nothing(60, 80, std::nanf(""));
  UnseenViews views(plane_seen_by(recorded));
  views.look_at(same, plane);
  pipeline::StageOutput fine;
  views.tell("", fine);
  EXPECT_TRUE(fine.warnings.empty());
  EXPECT_GT(fine.metrics.at("least_seen").get<double>(), 0.95);

  views.look_at(aside, plane);
  pipeline::StageOutput one;
  views.tell("poses_visible", one);
  ASSERT_EQ(one.warnings.size(), 1U);
  EXPECT_THAT(one.warnings[0], HasSubstr("aside (0 %)"));
  EXPECT_THAT(one.warnings[0], ::testing::Not(HasSubstr("poses_visible")));

  UnseenViews all(plane_seen_by(recorded));
  all.look_at(aside, nothing);
  pipeline::StageOutput none;
  all.tell("poses_visible", none);
  ASSERT_EQ(none.warnings.size(), 1U);
  EXPECT_THAT(none.warnings[0], HasSubstr("show nothing of the scene: aside"));
  EXPECT_THAT(none.warnings[0], HasSubstr("the world of OUT/poses_visible/transforms.json"));
}

}  // namespace
}  // namespace orbitfuse::stages
