// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/ground_truth.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using test::put;
using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string k = R"("K": {"fx": 90, "fy": 90, "cx": 50, "cy": 40, "w": 100, "h": 80})";

std::string truth_with(const std::string& c2w, const std::string& camera = k) {
  return R"({"visible": {)" + camera +
         R"(, "frames": [{"file": "visible/0.jpg", "el": 20, "c2w": )" + c2w + "}]}}";
}

TEST(GroundTruth, IsReadWithTestViewsAndElevations) {
  const test::TempFolder folder;
  const std::string pose = "[[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]";
  put(folder / "t.json",
      R"({"thermal": {)" + k + R"(, "frames": [{"file": "a.tiff", "az": 5, "c2w": )" + pose +
          R"(}]}, "test": {)" + k + R"(, "frames": [{"visible": "v.jpg", "c2w": )" + pose + "}]}}");
  const auto truth = read_ground_truth(folder / "t.json");
  ASSERT_TRUE(truth) << truth.error().message();
  ASSERT_EQ(truth->views.at(Modality::thermal).size(), 1u);
  const TrueView& view = truth->views.at(Modality::thermal)[0];
  EXPECT_EQ(view.azimuth_deg, 5);
  EXPECT_FALSE(view.elevation_deg);
  EXPECT_LT((camera_center(view.cam_from_world) - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
  ASSERT_EQ(truth->test.size(), 1u);
  EXPECT_EQ(truth->test[0].visible, folder / "v.jpg");
  EXPECT_TRUE(truth->test[0].thermal.empty());
}

TEST(GroundTruth, AKeyThatIsThereTwiceIsNamed) {
  const test::TempFolder folder;
  std::string text = truth_with("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]");
  text.insert(text.find("\"el\""), "\"el\": 30,\n");
  put(folder / "t.json", text);
  const auto truth = read_ground_truth(folder / "t.json");
  ASSERT_FALSE(truth);
  EXPECT_THAT(truth.error().message(),
              AllOf(HasSubstr("t.json"), HasSubstr("key \"el\" twice"), HasSubstr("line 2")));
}

TEST(GroundTruth, PosesThatAreNotRigidAndNumbersThatAreNoneAreNamed) {
  const test::TempFolder folder;
  const std::pair<std::string, std::string> cases[] = {
      {truth_with("[[1,0,0,0],[5,1,0,0],[0,0,1,0],[0,0,0,1]]"), "no rotation"},
      {truth_with("[[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]]"), "no rotation"},
      {truth_with("[[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]"), "mirrors"},
      {truth_with("[[1,0,0,1e300],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"), "1e+300"},
      {truth_with("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[1,0,0,1]]"), "last row"},
      {truth_with("[[1,0,0,0],[0,1,0,0]]"), "4x4"},
      {truth_with(R"("far away")"), "4x4"}};
  for (const auto& [text, words] : cases) {
    put(folder / "t.json", text);
    const auto truth = read_ground_truth(folder / "t.json");
    ASSERT_FALSE(truth) << text;
    EXPECT_THAT(truth.error().message(),
                AllOf(HasSubstr("visible.frames[0].c2w"), HasSubstr(words)));
  }
  const std::string identity = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";
  for (const char* camera :
       {R"("K": {"fx": 1e300, "fy": 90, "cx": 50, "cy": 40, "w": 100, "h": 80})",
        R"("K": {"fx": 90, "fy": 90, "cx": 50, "cy": 40, "w": 1e300, "h": 80})",
        R"("K": {"fx": 90, "fy": 90, "cx": 50, "cy": 40, "w": 100, "h": 80, "k1": 1e300})",
        R"("K": {"fx": 90, "fy": 90, "cx": 50, "w": 100, "h": 80})", R"("K": 7)"}) {
    put(folder / "t.json", truth_with(identity, camera));
    EXPECT_FALSE(read_ground_truth(folder / "t.json")) << camera;
  }
  for (const char* text : {"", "[]", "{}", "{\"visible\": 3}", "{\"visible\": {\"frames\": []}}"}) {
    put(folder / "t.json", text);
    EXPECT_FALSE(read_ground_truth(folder / "t.json")) << text;
  }
}

TEST(GroundTruth, WhatWouldBeTakenForAnotherFrameIsNamed) {
  const test::TempFolder folder;
  const std::string pose = R"("c2w": [[1,0,0,0],[0,1,0,0],[0,0,1,0]])",
                    one = R"({"file": "a.jpg", )" + pose + "}";
  const auto with = [&](const std::string& frames, const std::string& test = "") {
    put(folder / "t.json", "{\"visible\": {" + k + ", \"frames\": [" + frames + "]}, \"test\": {" +
                               k + ", \"frames\": [" + test + "]}}");
    const auto truth = read_ground_truth(folder / "t.json");
    return truth ? std::string() : truth.error().message();
  };
  EXPECT_EQ(with(one), "");
  EXPECT_THAT(with(one + ", " + one), AllOf(HasSubstr("visible.frames[1].file"),
                                            HasSubstr("a.jpg, which is listed before")));
  EXPECT_THAT(with(R"({"file": "", )" + pose + "}"), HasSubstr("visible.frames[0].file"));
  EXPECT_THAT(with(""), AllOf(HasSubstr("visible.frames"), HasSubstr("an empty list")));
  EXPECT_THAT(with(one, R"({"visible": 7, )" + pose + "}"), HasSubstr("test.frames[0].visible"));
  EXPECT_THAT(with(R"({"file": "a.jpg", "c2w": [[NaN]]})"),
              AllOf(HasSubstr("t.json"), HasSubstr("line 1"), HasSubstr("[N'")));
}

}  // namespace
}  // namespace orbitfuse
