// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/import.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <opencv2/imgproc.hpp>
#include <set>
#include <sstream>

#include "core/formats/colmap_model.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "tests/drivers/stills/import_files.hpp"
#include "tests/support/made_files.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class ImportTest : public ImportFiles {
 protected:
  void put_photo(const std::string& name) const {
    cv::Mat image(30, 40, CV_8UC3);
    cv::RNG random(std::hash<std::string>{}(name));  // copies are left out
    random.fill(image, cv::RNG::UNIFORM, 0, 255);
    put(name, *encode_jpeg(image, 90));
  }
};

void append(std::string& to, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) to += static_cast<char>(value >> (8 * i));
}

/// A JPEG whose EXIF tells the 35 mm equivalent of its focal length.
std::string jpeg_with_focal(int width, int height, int focal_35mm, int scene = 0) {
  cv::Mat image(height, width, CV_8UC3);
  cv::RNG(static_cast<std::uint64_t>(width + focal_35mm + scene))
      .fill(image, cv::RNG::UNIFORM, 0, 255);
  std::string jpeg = *encode_jpeg(image, 90);
  std::string exif("Exif\0\0II*\0", 10);
  const auto directory = [&exif](int tag, int type, int value) {  // of one entry
    append(exif, 1, 2);
    append(exif, static_cast<std::uint32_t>(tag), 2);
    append(exif, static_cast<std::uint32_t>(type), 2);
    append(exif, 1, 4);
    append(exif, static_cast<std::uint32_t>(value), 4);
    append(exif, 0, 4);
  };
  append(exif, 8, 4);
  directory(0x8769, 4, 26);  // the EXIF directory follows this one
  directory(0xa405, 3, focal_35mm);
  std::string segment("\xff\xe1", 2);
  segment += static_cast<char>((exif.size() + 2) >> 8);
  segment += static_cast<char>((exif.size() + 2) & 0xff);
  return jpeg.insert(2, segment + exif);
}

/// The table of a published calibration image: rows of degrees Celsius.
std::vector<std::vector<double>> celsius_table(const fs::path& file) {
  std::string text = *read_file(file);
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  std::vector<std::vector<double>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.find_first_of("0123456789") == std::string::npos) continue;
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');)
      if (cell.find_first_of("0123456789") != std::string::npos)
        rows.back().push_back(std::stod(cell));
  }
  return rows;
}

TEST_F(ImportTest, OneFolderIsNoPairOfOrbits) {
  for (const int i : {0, 1, 2}) put_photo(fmt::format("in/{}.jpg", i));
  options.visible = options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::input);
  EXPECT_NE(report.error().found.find("the same image as"), std::string::npos);
  put_photo("other/own.jpg");
  options.thermal = {folder / "in", folder / "other"};
  EXPECT_TRUE(import()) << "some files in both are only odd";
}

TEST_F(ImportTest, PhotosOfSeveralLensesAndSizesAreKeptApartAndNamed) {
  put("in/a.jpg", jpeg_with_focal(40, 30, 24));
  put("in/b.jpg", jpeg_with_focal(40, 30, 24, 1));
  put("in/c.jpg", jpeg_with_focal(40, 30, 70));
  put("in/d.jpg", jpeg_with_focal(48, 32, 24));
  options.visible = {folder / "in"};
  auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  ASSERT_EQ(report->session.devices.size(), 3u);
  std::map<std::string, int> frames;
  for (const FrameRecord& frame : report->session.frames) ++frames[frame.device];
  EXPECT_EQ(frames,
            (std::map<std::string, int>{{"visible0", 2}, {"visible1", 1}, {"visible2", 1}}));
  EXPECT_NEAR(*report->session.device("visible1")->lens.focal_px /
                  *report->session.device("visible0")->lens.focal_px,
              70.0 / 24, 1e-9);
  const auto tells =
      ::testing::AllOf(HasSubstr("in/a.jpg"), HasSubstr("in/c.jpg"), HasSubstr("70 mm"),
                       HasSubstr("in/d.jpg"), HasSubstr("48x32"), HasSubstr("leave out"));
  EXPECT_THAT(report->warnings, ::testing::Contains(tells));
  // One focal length in pixels can't be true of all of them.
  options.visible_focal_px = 35;
  fs::remove_all(folder / "session");
  report = import();
  ASSERT_FALSE(report);
  EXPECT_THAT(
      report.error().message(),
      ::testing::AllOf(HasSubstr("in/a.jpg"), HasSubstr("in/c.jpg"), HasSubstr("one by one")));
  EXPECT_FALSE(fs::exists(folder / "session"));
}

TEST_F(ImportTest, ThermalFilesOfSeveralCamerasAreKeptApartAndNamed) {
  const fs::path samples = testing::shared_data() / "rjpeg";
  if (!fs::exists(samples)) GTEST_SKIP() << "the shared radiometric JPEGs are not here";
  options.thermal = {samples};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_GE(report->session.devices.size(), 4u);
  EXPECT_THAT(report->warnings, ::testing::Contains(::testing::AllOf(
                                    HasSubstr("T640"), HasSubstr("b60"), HasSubstr("E40"))));
  for (const DeviceInfo& device : report->session.devices) {
    std::set<std::pair<int, int>> sizes;
    for (const FrameRecord& frame : report->session.frames)
      if (frame.device == device.id) sizes.insert({frame.width, frame.height});
    EXPECT_EQ(sizes.size(), 1u) << device.id;
  }
}

TEST_F(ImportTest, RadiometricJpegMatchesThePublishedTemperatures) {
  const fs::path sample = testing::shared_data() / "rjpeg/irimage_test";
  if (!fs::exists(sample)) GTEST_SKIP() << "the shared radiometric JPEGs are not here";
  options.thermal = {sample / "test_image.jpg"};
  options.object = {0.95, 5.0, 280.15, 293.15, 0.5};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->has_temperatures);
  const auto kelvin = read_thermal_k(report->session.path_of(report->session.frames.at(0)));
  ASSERT_TRUE(kelvin);
  const auto expected = celsius_table(sample / "expected_celsius.csv");
  ASSERT_EQ(static_cast<int>(expected.size()), kelvin->rows);
  double worst = 0;
  for (int y = 0; y < kelvin->rows; ++y) {
    ASSERT_EQ(static_cast<int>(expected[static_cast<std::size_t>(y)].size()), kelvin->cols);
    for (int x = 0; x < kelvin->cols; ++x)
      worst = std::max(
          worst, std::abs(kelvin->at<float>(y, x) - 273.15 -
                          expected[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)]));
  }
  EXPECT_LT(worst, 0.02);  // degrees Celsius; the bar is 0.2
}

TEST_F(ImportTest, EveryCameraModelAtHandDecodesToPlausibleTemperatures) {
  const fs::path samples = testing::shared_data() / "rjpeg";
  if (!fs::exists(samples)) GTEST_SKIP() << "the shared radiometric JPEGs are not here";
  options.thermal = {samples};
  options.embedded_visible = true;
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->thermal, 11);
  for (const FrameRecord* frame : report->session.frames_of(Modality::thermal)) {
    const auto kelvin = read_thermal_k(report->session.path_of(*frame));
    ASSERT_TRUE(kelvin);
    double low = 0, high = 0;
    cv::minMaxLoc(*kelvin, &low, &high);
    EXPECT_GT(low, 200) << frame->source;
    EXPECT_LT(high, 500) << frame->source;
  }
}

TEST_F(ImportTest, ThermalImagesAmongPhotosAreLeftOutByName) {
  put_photo("in/dc_1.jpg");
  put("in/ir_1.jpg",
      made::flir_jpeg(cv::Mat(24, 32, CV_16U, cv::Scalar(14000)), made::flir_calibration()));
  options.visible = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 1);
  EXPECT_THAT(report->warnings,
              ::testing::Contains(::testing::AllOf(HasSubstr("ir_1.jpg"), HasSubstr("--thermal"))));
  // Nothing else there: no session without the photos that were asked for.
  fs::remove(folder / "in/dc_1.jpg");
  fs::remove_all(folder / "session");
  const auto none = import();
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message(), HasSubstr("ir_1.jpg"));
}

TEST_F(ImportTest, RadiometricJpegCutAnywhereIsAnErrorOrAWholeImage) {
  const fs::path sample = testing::shared_data() / "rjpeg/irimage_test/test_image.jpg";
  if (!fs::exists(sample)) GTEST_SKIP() << "the shared radiometric JPEGs are not here";
  const std::string whole = *read_file(sample);
  for (int part = 0; part < 16; ++part) {
    put("in/cut.jpg", whole.substr(0, whole.size() * static_cast<std::size_t>(part) / 16));
    options.thermal = {folder / "in/cut.jpg"};
    fs::remove_all(folder / "session");
    const auto report = import();
    if (!report) {
      EXPECT_THAT(report.error().message(), HasSubstr("cut.jpg"));
    } else {
      EXPECT_EQ(report->thermal, 1);
    }
  }
}

TEST_F(ImportTest, ATextNamedJpgIsRefusedByName) {
  put_photo("in/a.jpg");
  put("in/b.jpg", "this is not a picture");
  options.visible = {folder / "in"};
  const auto report = import();
  if (report) {
    EXPECT_EQ(report->visible, 1);
    EXPECT_THAT(report->warnings, ::testing::Contains(HasSubstr("b.jpg")));
  } else {
    EXPECT_THAT(report.error().message(), HasSubstr("b.jpg"));
  }
}

TEST_F(ImportTest, SixteenBitIsCentikelvinAndEightBitHasNoTemperatures) {
  const cv::Mat centikelvin(30, 40, CV_16UC1, cv::Scalar(30115));
  put("in/t.tiff", *encode_thermal_tiff(centikelvin));
  options.thermal = {folder / "in/t.tiff"};
  auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  const auto kelvin = read_thermal_k(report->session.path_of(report->session.frames.at(0)));
  ASSERT_TRUE(kelvin);
  EXPECT_NEAR(kelvin->at<float>(5, 5), 301.15, 1e-3);

  ASSERT_TRUE(write_png(folder / "in/g.png", cv::Mat(30, 40, CV_8UC1, cv::Scalar(77))));
  options.thermal = {folder / "in/g.png"};
  fs::remove_all(folder / "session");
  report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_FALSE(report->has_temperatures);
  EXPECT_TRUE(report->session.frames.at(0).thermal_is_gray);
}

TEST_F(ImportTest, ColouredThermalPicturesAreNamed) {
  const auto warns = [&](const std::string& what) {
    fs::remove_all(folder / "session");
    const auto report = import();
    EXPECT_TRUE(report) << report.error().message();
    return report && std::any_of(report->warnings.begin(), report->warnings.end(),
                                 [&](const std::string& w) { return w.find(what) != w.npos; });
  };
  cv::Mat gray(30, 40, CV_8UC1), colors;
  for (int i = 0; i < 1200; ++i)
    gray.at<std::uint8_t>(i / 40, i % 40) = static_cast<std::uint8_t>(i / 5);
  cv::merge(std::vector<cv::Mat>{gray, gray, gray}, colors);
  ASSERT_TRUE(write_png(folder / "in/same.png", colors));
  options.thermal = {folder / "in/same.png"};
  EXPECT_FALSE(warns("in colour")) << "grey in three channels";
  colors(cv::Rect(0, 0, 4, 4)).setTo(cv::Scalar(0, 0, 255));
  ASSERT_TRUE(write_png(folder / "in/logo.png", colors));
  options.thermal = {folder / "in/logo.png"};
  EXPECT_FALSE(warns("in colour")) << "a small mark";
  cv::applyColorMap(gray, colors, cv::COLORMAP_INFERNO);
  ASSERT_TRUE(write_png(folder / "in/palette.png", colors));
  options.thermal = {folder / "in/same.png", folder / "in/palette.png"};
  EXPECT_TRUE(warns("palette.png: in colour"));
}

TEST_F(ImportTest, CountsStayWithTheirFrameWhereFilesShareAName) {
  cv::Mat station(30, 40, CV_16UC1), tracking;
  for (int i = 0; i < 1200; ++i)
    station.at<std::uint16_t>(i / 40, i % 40) = static_cast<std::uint16_t>(5000 + i);
  tracking = station + 2000;
  put("in/stations/IR.tiff", *encode_tiff(station, "counts"));
  put("in/tracking/IR.tiff", *encode_tiff(tracking, "counts"));
  options.thermal = {folder / "in/stations/IR.tiff"};
  options.thermal_tracking = {folder / "in/tracking/IR.tiff"};
  options.thermal_scale = ThermalScale::raw_counts;
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  ASSERT_EQ(report->session.frames.size(), 2u);
  for (const FrameRecord& frame : report->session.frames) {
    const fs::path file(report->session.path_of(frame));
    const fs::path counts = file.parent_path() / "originals" / (file.stem().string() + ".tiff");
    const auto bytes = read_file(counts);
    ASSERT_TRUE(bytes) << counts;
    const auto image = decode_image(*bytes, "counts");
    ASSERT_TRUE(image);
    EXPECT_EQ(cv::norm(*image, frame.tracking ? tracking : station, cv::NORM_INF), 0);
  }
}

TEST_F(ImportTest, PosesComeFromTransformsAndFromColmapModels) {
  Reconstruction model;
  Transforms transforms;
  for (int i = 0; i < 3; ++i) {
    const std::string name = "p" + std::to_string(i) + ".jpg";
    put_photo("in/" + name);
    Camera camera = Camera::from_fov(40, 30, 50);
    Rigid3d pose;
    pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.3 * i, Eigen::Vector3d::UnitY()));
    pose.translation = {0.1 * i, 0, 2};
    model.views.push_back({name, camera, pose});
    TransformsFrame frame;
    frame.file_path = "in/" + name;
    frame.camera = camera;
    frame.cam_from_world = pose;
    transforms.frames.push_back(frame);
  }
  ASSERT_TRUE(write_transforms_json(folder / "transforms.json", transforms));
  const auto check = [&] {
    fs::remove_all(folder / "session");
    const auto report = import();
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->with_pose, 3);
    for (int i = 0; i < 3; ++i) {
      const FrameRecord& frame = report->session.frames.at(static_cast<std::size_t>(i));
      ASSERT_TRUE(frame.cam_from_world.has_value());
      const auto k = static_cast<std::size_t>(i);
      EXPECT_LT(
          (camera_center(*frame.cam_from_world) - camera_center(model.views[k].cam_from_world))
              .norm(),
          1e-9);
    }
  };
  options.transforms_json = folder / "transforms.json";
  check();
  options.transforms_json.reset();
  options.visible = {folder / "in"};
  options.visible_colmap = folder / "model";
  for (const ColmapFormat format : {ColmapFormat::text, ColmapFormat::binary}) {
    fs::remove_all(folder / "model");
    ASSERT_TRUE(write_colmap_model(folder / "model", model, format));
    check();
  }
}

TEST_F(ImportTest, PosesOfOtherPhotosAreRefusedAndMissingOnesTold) {
  for (const char* name : {"in/a.jpg", "in/b.jpg"}) put_photo(name);
  options.visible = {folder / "in"};
  options.transforms_json = folder / "transforms.json";
  const auto poses_of = [&](const std::string& file) {
    Transforms transforms;
    transforms.frames.push_back({});
    transforms.frames[0].file_path = file;
    transforms.frames[0].camera = Camera::from_fov(40, 30, 50);
    ASSERT_TRUE(write_transforms_json(folder / "transforms.json", transforms));
  };
  poses_of("elsewhere/c.jpg");
  const auto none = import();
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::input);
  EXPECT_THAT(none.error().message(), HasSubstr("0 of 2 images"));
  EXPECT_THAT(none.error().message(), HasSubstr("c.jpg"));

  fs::remove_all(folder / "session");
  poses_of("in/b.jpg");
  const auto one = import();
  ASSERT_TRUE(one) << one.error().message();
  EXPECT_EQ(one->with_pose, 1);
  EXPECT_THAT(one->warnings, ::testing::Contains(HasSubstr("1 of 2 images")));
}

TEST_F(ImportTest, AFolderInUseAndNothingToImportAreErrors) {
  EXPECT_FALSE(import());
  put_photo("in/a.jpg");
  options.visible = {folder / "in"};
  put("session/other.txt", "somebody's");
  const auto report = import();
  ASSERT_FALSE(report);
  EXPECT_THAT(report.error().message(), HasSubstr("session"));
  EXPECT_TRUE(fs::exists(folder / "session/other.txt"));
}

}  // namespace
}  // namespace orbitfuse
