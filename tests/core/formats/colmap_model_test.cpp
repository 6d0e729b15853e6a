// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/colmap_model.hpp"

#include <gtest/gtest.h>

#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using test::get;
using test::put;
using test::TempFolder;

Reconstruction small_model() {
  Reconstruction model;
  Camera camera = Camera::from_fov(640, 480, 60);
  camera.k1 = -0.1;
  camera.p2 = 0.003;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Quaterniond q = Eigen::Quaterniond(1, 0.1 * i, -0.2, 0.3).normalized();
    model.views.push_back(
        {"visible/00000" + std::to_string(i) + " x.jpg", camera, {q, {i + 0.25, 2, -3}}});
  }
  SparsePoint point{{1.5, -2.5, 1.0 / 3}, {10, 20, 250}, 0.7, {{0, {100.5, 7.25}}, {2, {3, 4}}}};
  model.points = {point, {{0, 0, 1}, {1, 2, 3}, 0.1, {{1, {5, 6}}}}};
  return model;
}

void expect_equal(const Reconstruction& a, const Reconstruction& b) {
  ASSERT_EQ(a.views.size(), b.views.size());
  for (std::size_t i = 0; i < a.views.size(); ++i) {
    EXPECT_EQ(a.views[i].name, b.views[i].name);
    EXPECT_EQ(a.views[i].camera, b.views[i].camera);
    EXPECT_LT(
        rotation_angle_deg(a.views[i].cam_from_world.rotation, b.views[i].cam_from_world.rotation),
        1e-6);
    EXPECT_EQ(a.views[i].cam_from_world.translation, b.views[i].cam_from_world.translation);
  }
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    EXPECT_EQ(a.points[i].position, b.points[i].position);
    EXPECT_EQ(a.points[i].rgb, b.points[i].rgb);
    ASSERT_EQ(a.points[i].track.size(), b.points[i].track.size());
    for (std::size_t k = 0; k < a.points[i].track.size(); ++k) {
      EXPECT_EQ(a.points[i].track[k].view, b.points[i].track[k].view);
      EXPECT_EQ(a.points[i].track[k].pixel, b.points[i].track[k].pixel);
    }
  }
}

class ColmapModel : public ::testing::TestWithParam<ColmapFormat> {};

TEST_P(ColmapModel, RoundTripIsExact) {
  const TempFolder folder;
  ASSERT_TRUE(write_colmap_model(folder / "m", small_model(), GetParam()));
  const auto back = read_colmap_model(folder / "m", Modality::thermal);
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->modality, Modality::thermal);
  expect_equal(*back, small_model());
}

TEST_P(ColmapModel, EveryTruncationIsAnErrorOrASmallerModel) {
  const TempFolder folder;
  ASSERT_TRUE(write_colmap_model(folder / "m", small_model(), GetParam()));
  const bool binary = GetParam() == ColmapFormat::binary;
  for (const char* stem : {"cameras", "images", "points3D"}) {
    const auto file = folder / (std::string("m/") + stem + (binary ? ".bin" : ".txt"));
    const std::string bytes = get(file);
    for (std::size_t keep = 0; keep < bytes.size(); ++keep) {
      put(file, bytes.substr(0, keep));
      const auto model = read_colmap_model(folder / "m", Modality::visible);
      if (binary) {
        ASSERT_FALSE(model) << stem << " cut to " << keep;
      } else if (model) {
        ASSERT_LE(model->points.size(), 2u);  // a text list may end anywhere
      }
    }
    put(file, bytes);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, ColmapModel,
                         ::testing::Values(ColmapFormat::text, ColmapFormat::binary));

TEST(ColmapText, ReadsEveryKnownCameraModelAndOddNames) {
  const TempFolder folder;
  put(folder / "m/cameras.txt",
      "# c\n1 SIMPLE_PINHOLE 10 20 5 4 9\n2 PINHOLE 10 20 5 6 4 9\n3 SIMPLE_RADIAL 10 20 5 4 9 "
      "0.1\n"
      "4 RADIAL 10 20 5 4 9 0.1 0.2\n5 OPENCV 10 20 5 6 4 9 .1 .2 .3 .4\n");
  std::string images = "# i\n";
  for (int i = 1; i <= 5; ++i)
    images += std::to_string(i) + " 1 0 0 0 1 2 3 " + std::to_string(i) + " a b" +
              std::to_string(i) + ".jpg\n\n";
  put(folder / "m/images.txt", images);
  const auto model = read_colmap_model(folder / "m", Modality::visible);
  ASSERT_TRUE(model) << model.error().message();
  ASSERT_EQ(model->views.size(), 5u);
  EXPECT_EQ(model->views[0].name, "a b1.jpg");
  EXPECT_EQ(model->views[1].camera.fy, 6);
  EXPECT_EQ(model->views[2].camera.k1, 0.1);
  EXPECT_EQ(model->views[3].camera.k2, 0.2);
  EXPECT_EQ(model->views[4].camera.p2, 0.4);
  EXPECT_TRUE(model->points.empty());
}

TEST(ColmapText, UnknownModelAndDanglingIdsAreNamed) {
  const TempFolder folder;
  put(folder / "m/cameras.txt", "1 FISHEYE 10 20 5 4 9\n");
  put(folder / "m/images.txt", "1 1 0 0 0 1 2 3 7 a.jpg\n\n");
  EXPECT_NE(read_colmap_model(folder / "m", Modality::visible).error().message().find("FISHEYE"),
            std::string::npos);
  put(folder / "m/cameras.txt", "1 PINHOLE 10 20 5 5 4 9\n");
  EXPECT_NE(read_colmap_model(folder / "m", Modality::visible).error().message().find("camera 7"),
            std::string::npos);
  EXPECT_FALSE(read_colmap_model(folder / "none", Modality::visible));
}

TEST(ColmapText, LinesThatCannotBeReadAreShown) {
  const TempFolder folder;
  const std::string camera = "1 PINHOLE 10 20 5 5 4 9\n", image = "1 1 0 0 0 1 2 3 1 a.jpg\n";
  const auto fault = [&](const std::string& cameras, const std::string& images,
                         const std::string& points) {
    put(folder / "m/cameras.txt", cameras);
    put(folder / "m/images.txt", images);
    put(folder / "m/points3D.txt", points);
    const auto model = read_colmap_model(folder / "m", Modality::visible);
    return model ? "" : model.error().message();
  };
  EXPECT_EQ(fault(camera, image + "5 6 -1 \n", ""), "");
  const std::string of_camera = fault("1 PINHOLE 10 wide 5 5 4 9\n", image + "\n", "");
  EXPECT_NE(of_camera.find("cameras.txt:1: unreadable line: \"1 PINHOLE 10 wide"),
            std::string::npos)
      << of_camera;
  for (const char* pixels :
       {"5 6 -1 7 8 nan", "5 6 -1 seven 8 -1", "5 6 -1 1e999", "5 6 -1 7e", "5 6 -1 -"}) {
    const std::string of_pixels = fault(camera, image + pixels + "\n", "");
    EXPECT_NE(of_pixels.find(std::string("images.txt:2: unreadable line: \"") + pixels),
              std::string::npos)
        << of_pixels;
  }
  EXPECT_NE(fault(camera, image, "").find("a.jpg: no line of observations"), std::string::npos);
  EXPECT_NE(fault(camera, image + "5 6 7\n", "7 0 0 1 9 9 9 0.5 1 0 99999999999\n").find("9999"),
            std::string::npos);
  EXPECT_NE(fault(camera, image + "5 6 7\n", "7 0 0 1 9 9 9 0.5 1 0 rest\n").find("rest"),
            std::string::npos);
}

/// Which of the two lenses is meant nobody knows, nor whose observations a point's are.
TEST(ColmapText, NumbersThatAreThereTwiceAreNamed) {
  const TempFolder folder;
  const std::string camera = "1 PINHOLE 10 20 5 5 4 9\n", image = "1 1 0 0 0 1 2 3 1 ";
  const auto fault = [&](const std::string& cameras, const std::string& images) {
    put(folder / "m/cameras.txt", cameras);
    put(folder / "m/images.txt", images);
    const auto model = read_colmap_model(folder / "m", Modality::visible);
    return model ? "" : model.error().message();
  };
  EXPECT_EQ(fault(camera, image + "a.jpg\n\n"), "");
  EXPECT_NE(fault(camera + "1 PINHOLE 10 20 9 9 4 9\n", image + "a.jpg\n\n")
                .find("camera 1: is there twice"),
            std::string::npos);
  EXPECT_NE(fault(camera, image + "a.jpg\n\n" + image + "b.jpg\n\n")
                .find("image \"b.jpg\": has the number 1 of another image"),
            std::string::npos);
}

TEST(ColmapBinary, HugeCountsTakeNoMemory) {
  const TempFolder folder;
  ASSERT_TRUE(write_colmap_model(folder / "m", small_model(), ColmapFormat::binary));
  for (const char* file : {"cameras.bin", "images.bin", "points3D.bin"}) {
    const auto path = folder / (std::string("m/") + file);
    const std::string bytes = get(path);
    put(path, std::string(8, '\xFF') + bytes.substr(8));
    EXPECT_FALSE(read_colmap_model(folder / "m", Modality::visible)) << file;
    put(path, bytes);
  }
}

}  // namespace
}  // namespace orbitfuse
