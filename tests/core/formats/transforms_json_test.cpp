// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/transforms_json.hpp"

#include <gtest/gtest.h>

#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using test::put;
using test::TempFolder;

constexpr const char* identity = "[[1,0,0,4],[0,1,0,5],[0,0,1,6],[0,0,0,1]]";

TEST(TransformsJson, RoundTrip) {
  const TempFolder folder;
  TransformsFrame frame;
  frame.file_path = "images/a.jpg";
  frame.thermal_file_path = "thermal/a.png";
  frame.camera = Camera::from_fov(320, 240, 50);
  frame.camera.k1 = 0.01;
  frame.cam_from_world = {Eigen::Quaterniond(0.3, -0.5, 0.2, 0.7).normalized(), {1, -2, 3}};
  ASSERT_TRUE(write_transforms_json(folder / "t.json", {{frame, frame}}));
  const auto back = read_transforms_json(folder / "t.json");
  ASSERT_TRUE(back) << back.error().message();
  ASSERT_EQ(back->frames.size(), 2u);
  EXPECT_EQ(back->frames[1].thermal_file_path, "thermal/a.png");
  EXPECT_EQ(back->frames[1].camera, frame.camera);
  EXPECT_LT((back->frames[1].cam_from_world.translation - frame.cam_from_world.translation).norm(),
            1e-12);
  EXPECT_LT(
      rotation_angle_deg(back->frames[1].cam_from_world.rotation, frame.cam_from_world.rotation),
      1e-5);
}

TEST(TransformsJson, FieldOfViewAndPerFrameIntrinsics) {
  const TempFolder folder;
  put(folder / "t.json",
      std::string(R"({"camera_angle_x":1.5707963267948966,"w":200,"h":100,"frames":[)") +
          R"({"file_path":"a","transform_matrix":)" + identity + R"(},)" +
          R"({"file_path":"b","fl_x":77,"w":50,"transform_matrix":)" + identity + "}]}");
  const auto t = read_transforms_json(folder / "t.json");
  ASSERT_TRUE(t) << t.error().message();
  EXPECT_NEAR(t->frames[0].camera.fx, 100, 1e-9);
  EXPECT_EQ(t->frames[0].camera.cx, 100);
  EXPECT_EQ(t->frames[1].camera.fx, 77);
  EXPECT_EQ(t->frames[1].camera.cx, 25);
  // An OpenGL camera with the identity stands at its translation and looks along world -z.
  EXPECT_LT((camera_center(t->frames[0].cam_from_world) - Eigen::Vector3d(4, 5, 6)).norm(), 1e-12);
  EXPECT_LT((t->frames[0].cam_from_world.inverse().rotation * Eigen::Vector3d::UnitZ() +
             Eigen::Vector3d::UnitZ())
                .norm(),
            1e-12);
}

TEST(TransformsJson, WhereverItIsCutItIsRefused) {
  const TempFolder folder;
  TransformsFrame frame;
  frame.file_path = "images/\u00e9.jpg";
  frame.camera = Camera::from_fov(320, 240, 50);
  ASSERT_TRUE(write_transforms_json(folder / "t.json", {{frame}}));
  const std::string whole = read_file(folder / "t.json").value();
  for (std::size_t length = 0; length + 2 < whole.size(); ++length) {  // it ends with "}\n"
    put(folder / "t.json", whole.substr(0, length));
    const auto t = read_transforms_json(folder / "t.json");
    ASSERT_FALSE(t) << length;
    EXPECT_NE(t.error().message().find("cut off"), std::string::npos) << t.error().message();
  }
}

TEST(TransformsJson, BadInputNamesFrameAndField) {
  const TempFolder folder;
  const std::pair<std::string, std::string> cases[] = {
      {R"({"frames":[{"file_path":"a","transform_matrix":)" + std::string(identity) + "}]}",
       "size"},
      {R"({"w":4,"h":4,"frames":[{"file_path":"a","transform_matrix":)" + std::string(identity) +
           "}]}",
       "focal"},
      {R"({"w":4,"h":4,"fl_x":3,"frames":[{"file_path":"a"}]})", "transform_matrix"},
      {R"({"w":4,"h":4,"fl_x":3,"frames":[{"file_path":"a","transform_matrix":[[1,0,0,0],[0,"x",0,0],[0,0,1,0]]}]})",
       "transform_matrix"},
      {R"({"w":4,"h":4,"fl_x":3,"frames":[{"file_path":"a","transform_matrix":[[2,0,0,0],[0,2,0,0],[0,0,2,0]]}]})",
       "transform_matrix"},
      {R"({"w":4,"h":4,"fl_x":3,"k3":0.1,"frames":[{"file_path":"a","transform_matrix":)" +
           std::string(identity) + "}]}",
       "k3"},
      {R"({"frames":[]})", "frames"},
      {R"({"frames":[{"file_path":""}]})", "frames[0]: no file_path"},
      {"{\"w\":4,\n\"h\":4,\n\"w\":8,\"frames\":[{}]}",
       "key \"w\" twice in one object, the second time in line 3"},
      {R"({"frames":7})", "frames"},
      {R"({"frames":[{"file_p)", "cut off"},
      {"{\"frames\":[{\"file_path\":\"\xff\xfe\"}]}", "UTF-8"},
      {"\xff\xfe{\"frames\":[]}", "not JSON"},  // UTF-16's mark
      {"", "cut off"},
      {R"({"w":4,"h":4,"fl_x":1e999,"frames":[]})", "1e999"},
      {"[]", "object"}};
  for (const auto& [text, word] : cases) {
    put(folder / "t.json", text);
    const auto t = read_transforms_json(folder / "t.json");
    ASSERT_FALSE(t) << text;
    EXPECT_EQ(t.error().kind, ErrorKind::input);
    EXPECT_NE(t.error().message().find(word), std::string::npos) << t.error().message();
  }
}

TEST(TransformsJson, ASizeThatIsNotNamedIsTheFirstImages) {
  const TempFolder folder;
  std::filesystem::create_directories(folder / "train");
  ASSERT_TRUE(write_png(folder / "train/r_0.png", cv::Mat(30, 40, CV_8UC3, cv::Scalar(1, 2, 3))));
  const std::string frame =
      R"({"file_path":"./train/r_0","transform_matrix":)" + std::string(identity) + "}";
  put(folder / "t.json",
      R"({"camera_angle_x":1.5707963267948966,"frames":[)" + frame + "," + frame + "]}");
  const auto t = read_transforms_json(folder / "t.json");
  ASSERT_TRUE(t) << t.error().message();
  ASSERT_EQ(t->frames.size(), 2u);
  EXPECT_EQ(t->frames[1].camera.width, 40);
  EXPECT_EQ(t->frames[1].camera.height, 30);
  EXPECT_NEAR(t->frames[1].camera.fx, 20, 1e-9);
}

TEST(TransformsJson, LensesAnglesAndTextsThatWouldBendThePictureAreRefused) {
  const TempFolder folder;
  const auto read = [&](const std::string& shared, const std::string& own = "") {
    put(folder / "t.json", R"({"w":40,"h":30,)" + shared + R"("frames":[{"file_path":"a",)" + own +
                               R"("transform_matrix":)" + identity + "}]}");
    return read_transforms_json(folder / "t.json");
  };
  const auto found = [&](const std::string& shared, const std::string& own = "") {
    const auto t = read(shared, own);
    return t ? std::string("read") : t.error().message();
  };
  const std::string focal = R"("fl_x":50,)";
  for (const char* model : {"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"})
    EXPECT_EQ(found(focal + R"("camera_model":")" + model + R"(",)"), "read");
  EXPECT_EQ(found(focal + R"("camera_model":null,"is_fisheye":false,"k1":null,)"), "read");
  const std::pair<std::string, std::string> shared_cases[] = {
      {focal + R"("camera_model":"EQUIRECTANGULAR",)", "EQUIRECTANGULAR"},
      {focal + R"("camera_model":"OPENCV_FISHEYE",)", "OPENCV_FISHEYE"},
      {focal + R"("camera_model":7,)", "\"camera_model\": 7"},
      {focal + R"("is_fisheye":true,)", "\"is_fisheye\": true"},
      {R"("camera_angle_x":57.3,)", "radians"},
      {R"("camera_angle_x":0,)", "radians"},
      {focal + R"("camera_angle_y":-0.5,)", "camera_angle_y"},
      {R"("camera_angle_x":0.8,"fl_x":"90",)", "\"fl_x\": \"90\""},
      {focal + R"("cy":[15],)", "\"cy\""},
      {focal + R"("p2":false,)", "\"p2\""}};
  for (const auto& [text, word] : shared_cases)
    EXPECT_NE(found(text).find(word), std::string::npos) << found(text);
  // A frame's own field wins, and is no less looked at.
  EXPECT_NE(found(focal, R"("is_fisheye":true,)").find("is_fisheye"), std::string::npos);
  EXPECT_NE(found(focal, R"("w":"40",)").find("\"w\""), std::string::npos);
  EXPECT_EQ(found(focal + R"("is_fisheye":true,)", R"("is_fisheye":false,)"), "read");
}

}  // namespace
}  // namespace orbitfuse
