// SPDX-License-Identifier: BSD-3-Clause
// The programs of examples/ and of docs/library.md, built against the installed package, on data
// whose answers are known.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "core/formats/ply.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/image/image_io.hpp"
#include "fusion/metrics/metrics.hpp"
#include "tests/library/flir_jpeg_file.hpp"
#include "tests/support/cloud_scenes.hpp"
#include "tests/support/toy_scene.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;
const fs::path consumers = ORBITFUSE_CONSUMERS;

struct Outcome {
  int status = -1;
  std::string output;
};

Outcome run(const fs::path& program, const std::vector<fs::path>& arguments) {
  std::string command = (consumers / program).string();
  for (const fs::path& argument : arguments) command += " '" + argument.string() + "'";
  Outcome outcome;
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (!pipe) return outcome;
  std::array<char, 4096> part;
  for (std::size_t n = 0; (n = fread(part.data(), 1, part.size(), pipe)) > 0;)
    outcome.output.append(part.data(), n);
  outcome.status = pclose(pipe);
  return outcome;
}

fs::path data_folder(const std::string& name) {
  const fs::path folder = consumers / "data" / name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

class Clouds : public ::testing::Test {
 protected:
  void SetUp() override {
    pair = scenes::make_pair(*scenes::surface("car"), scenes::levels().front(), 3);
    ASSERT_TRUE(write_ply(folder / "source.ply", pair.source));
    ASSERT_TRUE(write_ply(folder / "target.ply", pair.target));
  }
  /// The program prints the 4x4 matrix first.
  double error_percent(const std::string& output) const {
    std::istringstream numbers(output);
    Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) numbers >> m(row, column);
    Similarity3d found;
    found.scale = std::cbrt(m.topLeftCorner<3, 3>().determinant());
    found.rotation = Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>() / found.scale));
    found.translation = m.topRightCorner<3, 1>();
    return scenes::surface_rmse_percent(pair, found);
  }
  // In a folder of its own for each test, which may run beside the other.
  fs::path folder = data_folder(::testing::UnitTest::GetInstance()->current_test_info()->name());
  scenes::CloudPair pair;
};

TEST_F(Clouds, ExampleFindsTheSimilarity) {
  const Outcome outcome =
      run("examples/01_register_clouds", {folder / "source.ply", folder / "target.ply"});
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_LT(error_percent(outcome.output), 1) << outcome.output;
}

TEST_F(Clouds, ProjectOfTheDocumentationFindsIt) {
  const Outcome outcome =
      run("stranger/build/my_registration", {folder / "source.ply", folder / "target.ply"});
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_LT(error_percent(outcome.output), 1) << outcome.output;
}

TEST_F(Clouds, MissingFileIsNamed) {
  const Outcome outcome =
      run("examples/01_register_clouds", {folder / "absent.ply", folder / "target.ply"});
  EXPECT_NE(outcome.status, 0);
  EXPECT_NE(outcome.output.find("absent.ply"), std::string::npos) << outcome.output;
}

TEST(Examples, FuseImages) {
  const fs::path folder = data_folder("fuse");
  // A bright square only the visible image has, a disc only the thermal one has.
  cv::Mat visible(120, 160, CV_8UC3, cv::Scalar(60, 80, 100)),
      thermal(120, 160, CV_8UC1, cv::Scalar(40));
  cv::rectangle(visible, cv::Rect(20, 40, 30, 30), cv::Scalar(220, 220, 220), cv::FILLED);
  cv::circle(thermal, {120, 60}, 15, cv::Scalar(230), cv::FILLED);
  ASSERT_TRUE(write_png(folder / "visible.png", visible));
  ASSERT_TRUE(write_png(folder / "thermal.png", thermal));
  const Outcome outcome =
      run("examples/02_fuse_images",
          {folder / "visible.png", folder / "thermal.png", folder / "fused.png"});
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("Qabf"), std::string::npos) << outcome.output;
  const auto fused = read_image(folder / "fused.png");
  ASSERT_TRUE(fused);
  const auto mean = [&](cv::Rect where) { return cv::mean((*fused)(where))[1]; };
  const double plain = mean({60, 5, 20, 20});
  EXPECT_GT(mean({25, 45, 20, 20}), plain + 30);   // the square
  EXPECT_GT(mean({112, 52, 16, 16}), plain + 30);  // and the disc
}

TEST(Examples, TrainAndRender) {
  const fs::path folder = data_folder("train");
  const nerf::Dataset scene = nerf::test::toy_scene(Modality::visible, 16);
  Transforms transforms;
  for (const nerf::TrainingView& view : scene.views) {
    cv::Mat bgr, bgr8;
    cv::cvtColor(view.image, bgr, cv::COLOR_RGB2BGR);
    bgr.convertTo(bgr8, CV_8U, 255);
    const std::string name = std::to_string(transforms.frames.size()) + ".png";
    ASSERT_TRUE(write_png(folder / name, bgr8));
    transforms.frames.push_back({name, {}, view.camera, view.cam_from_world});
  }
  ASSERT_TRUE(write_transforms_json(folder / "transforms.json", transforms));
  const Outcome outcome =
      run("examples/03_train_and_render", {folder / "transforms.json", "150", folder / "view.png"});
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  // 150 steps tell the object's place and colours, which a wrong axis, order or scale would not.
  const auto photo = read_visible(folder / "0.png"), view = read_visible(folder / "view.png");
  ASSERT_TRUE(photo && view);
  const cv::Mat plain(photo->size(), photo->type(), cv::mean(*photo));
  EXPECT_GT(*metrics::psnr(*photo, *view), *metrics::psnr(*photo, plain) + 3) << outcome.output;
}

TEST(Examples, HottestKelvinOfARadiometricJpeg) {
  const fs::path folder = data_folder("flir");
  const PlanckConstants planck{21106.77, 0.012545258, 1501, 1, -7340};
  cv::Mat counts(60, 80, CV_16UC1, cv::Scalar(13000));
  counts.at<std::uint16_t>(20, 30) = 16000;
  counts.at<std::uint16_t>(0, 0) = 65535;  // "that or more": no temperature
  std::ofstream(folder / "photo.jpg", std::ios::binary) << test::flir_jpeg_file(counts, planck);
  const Outcome outcome = run("examples/04_import_radiometric_jpeg", {folder / "photo.jpg"});
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const double expected =
      planck.b / std::log(planck.r1 / (planck.r2 * (16000 + planck.o)) + planck.f);
  EXPECT_NEAR(std::stod(outcome.output), expected, 0.01);
}

}  // namespace
}  // namespace orbitfuse
