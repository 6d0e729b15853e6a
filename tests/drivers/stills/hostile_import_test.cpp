// SPDX-License-Identifier: BSD-3-Clause
// Odd, damaged and mixed files: what is good is kept, what is not is named, and nothing is wrong
// without a word.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>

#include "capture/recording/session_writer.hpp"
#include "core/formats/colmap_model.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "drivers/stills/dji_jpeg.hpp"
#include "drivers/stills/import.hpp"
#include "tests/drivers/stills/import_files.hpp"
#include "tests/support/made_files.hpp"
#include "tests/support/says.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

class HostileImport : public ImportFiles {
 protected:
  /// Samples around `middle`, different for each seed.
  static cv::Mat counts(double middle, std::uint64_t seed) {
    cv::Mat image(30, 40, CV_16UC1);
    cv::RNG(seed + 1).fill(image, cv::RNG::UNIFORM, middle - 200, middle + 200);
    return image;
  }
  void put_centikelvin(const std::string& name, std::uint64_t seed) const {
    put(name, *encode_tiff(counts(29500, seed), ""));
  }
};

/// A PNG that plays: acTL, with the number of its pictures, before the image data.
std::string animated(const std::string& png, char frames) {
  const std::string kind_and_data =
      std::string("acTL") + std::string(3, '\0') + frames + std::string(4, '\0');
  const auto word = [](std::uint32_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift);
    return bytes;
  };
  std::uint32_t crc = 0xffffffff;
  for (const char c : kind_and_data) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
  }
  constexpr std::size_t header_end = 33;
  return png.substr(0, header_end) + word(8) + kind_and_data + word(~crc) + png.substr(header_end);
}

/// Noise with an alpha of `alpha` in the left half, opaque in the right one.
std::string half_transparent(int alpha, std::uint64_t seed) {
  cv::Mat image(30, 40, CV_8UC4);
  cv::RNG(seed).fill(image, cv::RNG::UNIFORM, 0, 255);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<cv::Vec4b>(y, x)[3] = static_cast<std::uint8_t>(x < 20 ? alpha : 255);
  return *encode_png(image);
}

/// It would be told as a camera of its own, and no focal length that is given would suit both.
TEST_F(HostileImport, AThermalFileAmongPhotosIsNoSecondCamera) {
  put_centikelvin("in/0.tiff", 1);
  put("in/1.png", half_transparent(255, 2));
  put_photo("in/2.jpg", 3);
  options.visible = {folder / "in"};
  options.visible_focal_px = 50;
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 2);
  EXPECT_EQ(report->session.devices.size(), 1u);
  EXPECT_THAT(report->warnings, test::one_says("left out", "0.tiff", "Give it as thermal"));
  EXPECT_THAT(report->warnings, test::none_says("cameras, lenses"));
}

TEST_F(HostileImport, AFocalLengthInMillimetresIsRefused) {
  put_photo("in/0.jpg", 1);
  options.visible = {folder / "in"};
  options.visible_focal_px = 4;
  const auto refused = import();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::usage);
  EXPECT_THAT(refused.error().message(),
              ::testing::AllOf(
                  ::testing::HasSubstr("--visible-focal-px: a focal length of 4 px, with which"),
                  ::testing::HasSubstr("millimetres times the image's width")));
  options.visible_focal_px = 40;
  EXPECT_TRUE(import());
}

TEST_F(HostileImport, AnAnimatedPngIsNoPhoto) {
  put_photo("in/0.jpg", 1);
  put("in/1.png", animated(half_transparent(255, 2), 3));
  put("in/2.png", animated(half_transparent(255, 3), 1));  // a still one that says so
  options.visible = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 2);
  EXPECT_THAT(report->warnings, test::one_says("left out", "1.png", "animated PNG of 3 frames"));
  options.visible = {folder / "in/1.png"};
  const auto alone = import_session(options, folder / "other");
  ASSERT_FALSE(alone);
  EXPECT_THAT(alone.error().message(), test::says("animated PNG of 3 frames"));
}

/// What lies behind a transparent pixel is any colour at all.
TEST_F(HostileImport, ImagesWithTransparentPixelsAreNamed) {
  put("in/0.png", half_transparent(255, 1));
  put("in/1.png", half_transparent(0, 2));
  put("in/2.png", half_transparent(200, 3));
  put("thermal/0.png", half_transparent(10, 4));
  options.visible = {folder / "in"};
  options.thermal = {folder / "thermal"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 3);
  EXPECT_THAT(report->warnings,
              test::one_says("3 images have transparent pixels: ",
                             "in/1.png (50 %), in/2.png (50 %), thermal/0.png (50 %)"));
  EXPECT_THAT(report->warnings, test::none_says("in/0.png"));
}

TEST_F(HostileImport, GlowingSpotsKeepTheirTemperature) {
  cv::Mat hot = counts(29300 / 4, 1);       // 293 K at 0.04 K a count
  hot.at<std::uint16_t>(3, 7) = 1173 * 25;  // 900 C
  put("in/0.tiff", *encode_tiff(hot, R"({"scale":0.04,"offset":0})"));
  put_centikelvin("in/1.tiff", 2);
  FlirCalibration camera = made::flir_calibration();
  camera.planck.r1 *= 0.3;  // the camera's range for hot objects
  cv::Mat signal(30, 40, CV_16UC1, cv::Scalar(made::flir_signal(300, camera)));
  signal.at<std::uint16_t>(5, 6) = made::flir_signal(1173.15, camera);
  put("in/2.jpg", made::flir_jpeg(signal, camera));
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  ASSERT_EQ(report->thermal, 3);
  EXPECT_NEAR(kelvin_of(*report, 0).at<float>(3, 7), 1173, 0.02);
  EXPECT_NEAR(kelvin_of(*report, 0).at<float>(0, 0), hot.at<std::uint16_t>(0, 0) * 0.04, 0.02);
  EXPECT_NEAR(kelvin_of(*report, 1).at<float>(0, 0),
              counts(29500, 2).at<std::uint16_t>(0, 0) * 0.01, 0.0101);
  EXPECT_NEAR(kelvin_of(*report, 2).at<float>(5, 6), 1173.15, 0.5);  // one signal is 0.1 K there
  EXPECT_NEAR(kelvin_of(*report, 2).at<float>(0, 0), 300, 0.1);
  for (const FrameRecord& frame : report->session.frames) {
    const std::string sidecar = test::get(report->session.path_of(frame).string() + ".json");
    EXPECT_THAT(sidecar, test::says("\"scale\":0.02")) << "one scale for the session";
    EXPECT_NEAR(frame.quality->mean_level, 297, 5);
  }
  EXPECT_THAT(report->warnings, test::one_says("0.02 K a count"));
}

TEST_F(HostileImport, OrdinarySessionsStayCentikelvin) {
  put_centikelvin("in/0.tiff", 1);
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->kelvin_per_count, 0.01);
  EXPECT_EQ(kelvin_of(*report, 0).at<float>(1, 1),
            static_cast<float>(counts(29500, 1).at<std::uint16_t>(1, 1) * 0.01));
}

TEST_F(HostileImport, WhatNoScaleHoldsIsTold) {
  cv::Mat hot = counts(3000, 1);
  hot.at<std::uint16_t>(3, 7) = 65535;
  put("in/0.tiff", *encode_tiff(hot, R"({"scale":0.2,"offset":0})"));  // 600 K, and 13,107 K
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(std::isnan(kelvin_of(*report, 0).at<float>(3, 7)));
  EXPECT_THAT(report->warnings, test::one_says("in/0.tiff", "1 of 1200 samples"));
}

TEST_F(HostileImport, CountsAmongTemperaturesAreLeftOutByName) {
  for (int i = 0; i < 4; ++i)
    put_centikelvin("in/" + std::to_string(i) + ".tiff", static_cast<std::uint64_t>(i));
  put("in/raw.tiff", *encode_tiff(counts(8000, 9), ""));
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->has_temperatures);
  EXPECT_EQ(report->thermal, 4);
  EXPECT_THAT(report->warnings, test::one_says("left out", "raw.tiff", "--kelvin-per-count"));
  EXPECT_NEAR(kelvin_of(*report, 0).at<float>(0, 0), 295, 2.1);
}

TEST_F(HostileImport, EightBitAmongTemperaturesIsLeftOutByName) {
  put_centikelvin("in/0.tiff", 1);
  put_photo("in/DC_1.jpg", 2);
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->has_temperatures);
  EXPECT_EQ(report->thermal, 1);
  EXPECT_THAT(report->warnings, test::one_says("left out", "DC_1.jpg", "--visible"));
}

TEST_F(HostileImport, AWholeFolderOfCountsStaysGrey) {
  for (int i = 0; i < 3; ++i)
    put("in/" + std::to_string(i) + ".tiff",
        *encode_tiff(counts(9000, static_cast<std::uint64_t>(i)), ""));
  put("in/warm.tiff",
      *encode_tiff(counts(18000, 9), ""));  // counts of the same camera, by the others' word
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_FALSE(report->has_temperatures);
  EXPECT_EQ(report->thermal, 4);
}

TEST_F(HostileImport, TagsThatMakeImpossibleTemperaturesAreRefused) {
  put("in/0.tiff", *encode_tiff(counts(30000, 1), R"({"scale":0.01,"offset":-273.15})"));
  put_centikelvin("in/1.tiff", 2);
  options.thermal = {folder / "in"};
  auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->thermal, 1);
  EXPECT_THAT(report->warnings, test::one_says("0.tiff", "-273.15"));

  options.thermal_scale = ThermalScale::linear;
  options.kelvin_per_count = 0.01;
  options.kelvin_offset = -300;
  fs::remove_all(folder / "session");
  report = import();
  ASSERT_FALSE(report);
  EXPECT_THAT(report.error().message(), test::says("--kelvin-offset"));

  options.kelvin_per_count = 0;  // never said
  report = import();
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::usage);
}

TEST_F(HostileImport, ABrokenSidecarIsNoSidecarToPassOver) {
  put_centikelvin("in/0.tiff", 1);
  put_centikelvin("in/1.tiff", 2);
  put("in/0.tiff.json", R"({"scale":)");
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->thermal, 1);
  EXPECT_THAT(report->warnings, test::one_says("0.tiff.json"));
}

TEST_F(HostileImport, EveryPageOfATiffIsAFrame) {
  put("in/0.tiff", made::tiff_of_pages({counts(29500, 1), counts(29600, 2), counts(29700, 3)}));
  put("in/1.tiff", made::tiff_of_pages({counts(29800, 4)}, R"({"scale":0.01})"));
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  ASSERT_EQ(report->thermal, 4);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(cv::mean(kelvin_of(*report, i))[0], 295 + static_cast<double>(i), 0.2);
  EXPECT_EQ(report->session.frames[1].source, "in/0.tiff#2");
  // Elsewhere one image is expected, and the first of several would be a guess.
  const auto image = read_image(folder / "in/0.tiff");
  ASSERT_FALSE(image);
  EXPECT_THAT(image.error().message(), test::says("3 pages"));
}

// Written by an encoder of the project's own, after the published layout: no public sample was at
// hand.
TEST_F(HostileImport, RecordingsAndJpegLsOfFlirCamerasAreRead) {
  const FlirCalibration camera = made::flir_calibration();
  const auto shot = [&](double kelvin) {
    return cv::Mat(30, 40, CV_16UC1, cv::Scalar(made::flir_signal(kelvin, camera)));
  };
  put("in/0.jpg", made::flir_jpeg(shot(300), camera, made::FlirPixels::jpeg_ls));
  put("in/1.seq", made::flir_file(shot(310), camera, made::FlirPixels::raw, {}) +
                      made::flir_file(shot(320), camera, made::FlirPixels::raw, {}));
  put("in/2.csq", made::flir_file(shot(330), camera, made::FlirPixels::jpeg_ls, {}) +
                      made::flir_file(shot(340), camera, made::FlirPixels::jpeg_ls, {}));
  put("in/3.csq",
      made::flir_file(shot(350), camera, made::FlirPixels::jpeg_ls, {}).substr(0, 700));  // cut
  const std::string whole = made::flir_file(shot(350), camera, made::FlirPixels::raw, {});
  put("in/4.seq", whole + whole.substr(0, 1500));  // a full card
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  ASSERT_EQ(report->thermal, 6);
  EXPECT_THAT(report->warnings, test::one_says("left out", "3.csq"));
  EXPECT_THAT(report->warnings, test::one_says("left out", "4.seq (image 2): "));
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(kelvin_of(*report, i).at<float>(9, 9), 300 + 10 * static_cast<double>(i), 0.1);
  EXPECT_EQ(report->session.frames[4].source, "in/2.csq#2");
}

TEST_F(HostileImport, CopiesAreImportedOnce) {
  put_photo("in/a.jpg", 1);
  put_photo("in/a copy.jpg", 1);
  put_photo("in/b.jpg", 2);
  put_centikelvin("t/0.tiff", 1);
  put_centikelvin("t/1.tiff", 1);
  options.visible = {folder / "in"};
  options.thermal = {folder / "t"};
  DeclaredStations stations;
  options.visible_stations = stations;
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 2);
  EXPECT_EQ(report->thermal, 1);
  EXPECT_EQ(report->session.frames_of(Modality::visible)[1]->station->index, 1)
      << "a copy is no station";
  EXPECT_THAT(report->warnings, test::one_says("a copy.jpg", "same image as"));
  EXPECT_THAT(report->warnings, test::one_says("t/1.tiff", "t/0.tiff"));
}

TEST_F(HostileImport, UnreadFormatsAreNamed) {
  put_photo("in/a.jpg", 1);
  // It says HEIC and is none.
  put("in/IMG_3.HEIC", std::string("\0\0\0\x18"
                                   "ftypheic",
                                   12));
  for (const char* name : {"in/b.dng", "in/c.webp", "in/d.mp4", "in/notes.txt"})
    put(name, "x");  // no video
  options.visible = {folder / "in"};
  auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  for (const char* name : {"IMG_3.HEIC", "b.dng", "c.webp", "d.mp4"})
    EXPECT_THAT(report->warnings, test::one_says("left out", name));
  EXPECT_THAT(report->warnings, test::none_says("notes.txt"));

  fs::remove(folder / "in/a.jpg");
  fs::remove(folder / "in/IMG_3.HEIC");
  fs::remove(folder / "in/d.mp4");
  fs::remove_all(folder / "session");
  report = import();
  ASSERT_FALSE(report);
  EXPECT_THAT(report.error().message(), test::says("convert them"));
}

TEST_F(HostileImport, DjiCountsAreNeverTemperaturesUnlessTheUserSaysHow) {
  // As centikelvin they would be a plausible 180 to 212 K.
  cv::Mat counts(120, 160, CV_16UC1);
  cv::RNG(3).fill(counts, cv::RNG::UNIFORM, 18073, 21222);
  const std::string bytes = made::dji_jpeg(counts);
  const auto dji = read_dji_thermal(bytes, "f");
  ASSERT_TRUE(dji) << dji.error().message();
  EXPECT_EQ(cv::countNonZero(dji->counts != counts), 0);
  ASSERT_TRUE(dji->parameters);
  EXPECT_NEAR(dji->parameters->emissivity, 0.95, 1e-6);
  EXPECT_NEAR(dji->parameters->distance_m, 5, 1e-6);
  put("in/DJI_1_T.JPG", bytes);
  put("in/DJI_2_T.JPG", made::dji_jpeg(counts + 5, false));
  options.thermal = {folder / "in"};
  auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->thermal, 2);
  EXPECT_FALSE(report->has_temperatures);
  EXPECT_THAT(report->warnings,
              test::one_says("2 thermal files of DJI", "not published",
                             "emissivity 0.95, distance 5.0 m, humidity 70 %, reflected "
                             "23.0 C, ambient 21.0 C",
                             "(and 1 other settings)"));
  EXPECT_EQ(report->session.frames.at(0).width, 160);
  EXPECT_EQ(report->session.devices.at(0).model, "DJI");

  fs::remove_all(folder / "session");
  put_centikelvin("in/a.tiff", 1);
  report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->thermal, 1) << "counts are left out beside temperatures";
  EXPECT_THAT(report->warnings, test::one_says("left out", "DJI_1_T.JPG"));

  fs::remove_all(folder / "session");
  fs::remove(folder / "in/a.tiff");
  options.thermal_scale = ThermalScale::linear;
  options.kelvin_per_count = 1.0 / 64;
  report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->has_temperatures);
  EXPECT_NEAR(kelvin_of(*report, 0).at<float>(0, 0), counts.at<std::uint16_t>(0, 0) / 64.0, 0.011);

  EXPECT_TRUE(is_dji_thermal(bytes));
  const std::string odd = made::dji_jpeg(cv::Mat(130, 160, CV_16UC1, cv::Scalar(5)));
  EXPECT_TRUE(is_dji_thermal(odd));
  EXPECT_FALSE(read_dji_thermal(odd, "f")) << "no size of its cameras";
}

TEST_F(HostileImport, TheLastCountOfAFileIsNoTemperature) {
  const FlirCalibration camera = made::flir_calibration();
  cv::Mat signal(30, 40, CV_16UC1, cv::Scalar(made::flir_signal(300, camera)));
  signal(cv::Rect(4, 5, 3, 2)).setTo(65535);
  put("in/0.jpg", made::flir_jpeg(signal, camera));
  cv::Mat centikelvin = counts(29500, 1);
  centikelvin(cv::Rect(4, 5, 1, 2)).setTo(65535);
  put("in/1.tiff", *encode_tiff(centikelvin, ""));
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  ASSERT_EQ(report->thermal, 2);
  EXPECT_TRUE(std::isnan(kelvin_of(*report, 0).at<float>(5, 4)));
  EXPECT_TRUE(std::isnan(kelvin_of(*report, 1).at<float>(5, 4)));
  EXPECT_NEAR(kelvin_of(*report, 0).at<float>(0, 0), 300, 0.1);
  EXPECT_THAT(report->warnings, test::one_says("0.jpg: 6 of 1200 samples", "that or hotter"));
  EXPECT_THAT(report->warnings, test::one_says("1.tiff: 2 of 1200 samples"));
}

TEST_F(HostileImport, TheEndsOfAFlirCamerasRangeAreNoTemperatures) {
  const FlirCalibration camera = made::flir_calibration();
  const made::SignalRange range{2500, 5000};
  cv::Mat signal(30, 40, CV_16UC1, cv::Scalar(made::flir_signal(300, camera)));
  ASSERT_GT(signal.at<std::uint16_t>(0, 0), range.lowest);
  ASSERT_LT(signal.at<std::uint16_t>(0, 0), range.highest);
  signal(cv::Rect(4, 5, 3, 2)).setTo(range.highest);
  signal(cv::Rect(4, 8, 1, 1)).setTo(range.highest + 3000);
  signal(cv::Rect(4, 9, 2, 2)).setTo(range.lowest);
  signal(cv::Rect(9, 9, 1, 1)).setTo(range.lowest + 1);
  signal(cv::Rect(9, 5, 1, 1)).setTo(range.highest - 1);
  put("in/0.jpg", made::flir_jpeg(signal, camera, made::FlirPixels::raw, {}, 60000, range));
  // A range beside which the image lies is not believed.
  put("in/1.jpg", made::flir_jpeg(signal + 1, camera, made::FlirPixels::raw, {}, 60000, {3, 7}));
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  const cv::Mat kelvin = kelvin_of(*report, 0);
  for (const cv::Point dead : {cv::Point(4, 5), cv::Point(6, 6), cv::Point(4, 8), cv::Point(5, 10)})
    EXPECT_TRUE(std::isnan(kelvin.at<float>(dead))) << dead;
  for (const cv::Point good : {cv::Point(0, 0), cv::Point(9, 9), cv::Point(9, 5)})
    EXPECT_FALSE(std::isnan(kelvin.at<float>(good))) << good;
  EXPECT_THAT(report->warnings, test::one_says("0.jpg: 11 of 1200 samples", "that or hotter"));
  EXPECT_TRUE(report->session.frames[0].has_flag(FrameFlag::clipped));
  EXPECT_FALSE(report->session.frames[1].has_flag(FrameFlag::clipped));
  EXPECT_FALSE(std::isnan(kelvin_of(*report, 1).at<float>(5, 4)));
}

TEST_F(HostileImport, LinksToNothingAndPipesAreNamed) {
  put_photo("in/a.jpg", 1);
  fs::create_symlink("nowhere.jpg", folder / "in/link.jpg");
  fs::create_symlink("self.png", folder / "in/self.png");
  ASSERT_EQ(::mkfifo((folder / "in/pipe.jpg").c_str(), 0600), 0);
  fs::create_directory(folder / "in/folder.jpg");
  options.visible = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 1);
  for (const char* file : {"link.jpg: no file", "self.png: no file", "pipe.jpg: no file"})
    EXPECT_THAT(report->warnings, test::one_says("left out", file));
  EXPECT_THAT(report->warnings, test::none_says("folder.jpg"));
}

TEST_F(HostileImport, ThermalFramesWithoutOneSampleAreLeftOut) {
  put_centikelvin("in/a.tiff", 1);
  put("in/b.tiff", *encode_tiff(cv::Mat::zeros(30, 40, CV_16UC1), ""));
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->thermal, 1);
  EXPECT_THAT(report->warnings, test::one_says("b.tiff", "not one sample"));
}

TEST_F(HostileImport, SidecarsOfManyLevelsAreRefused) {
  const std::string deep = std::string(200'000, '[') + std::string(200'000, ']');
  put_centikelvin("in/a.tiff", 1);
  put_centikelvin("in/b.tiff", 2);
  put("in/b.tiff.json", "{\"scale\":" + deep + "}");
  put("in/c.tiff",
      *encode_tiff(counts(29500, 3), "{\"scale\":" + deep.substr(190'000, 20'000) + "}"));
  options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->thermal, 1);
  EXPECT_THAT(report->warnings, test::one_says("b.tiff.json"));
  EXPECT_THAT(report->warnings, test::one_says("c.tiff", "lists within lists"));
}

TEST_F(HostileImport, ObjectParametersNeedRadiometricJpegs) {
  put_centikelvin("in/0.tiff", 1);
  options.thermal = {folder / "in"};
  options.object.emissivity = 0.8;
  auto report = import();
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::usage);
  EXPECT_FALSE(fs::exists(folder / "session"));
  const FlirCalibration camera = made::flir_calibration();
  put("in/1.jpg", made::flir_jpeg(counts(made::flir_signal(300, camera), 3), camera));
  report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_THAT(report->warnings, test::one_says("1 of 2 thermal files are no radiometric JPEGs"));
}

TEST_F(HostileImport, APhotoWithADamagedScanIsLeftOut) {
  put_photo("in/a.jpg", 1);
  cv::Mat image(240, 320, CV_8UC3);
  cv::RNG(5).fill(image, cv::RNG::UNIFORM, 0, 255);
  std::string bytes = *encode_jpeg(image, 90);
  for (std::size_t i = bytes.size() / 2; i < bytes.size() / 2 + 64; ++i)
    bytes[i] = static_cast<char>(bytes[i] ^ 0x55);
  put("in/b.jpg", bytes);
  options.visible = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 1);
  EXPECT_THAT(report->warnings, test::one_says("b.jpg", "JPEG"));
}

TEST_F(HostileImport, EndlessFilesAreRefusedAndLeaveTheWayFree) {
  Transforms transforms;
  for (const char* file : {"/dev/zero", "pipe", "huge.jpg", "in/a.jpg"}) {
    transforms.frames.push_back({file, {}, Camera::from_fov(40, 30, 50), {}});
  }
  ASSERT_TRUE(write_transforms_json(folder / "transforms.json", transforms));
  ASSERT_EQ(::system(("mkfifo " + (folder / "pipe").string()).c_str()), 0);
  std::ofstream(folder / "huge.jpg").close();
  fs::resize_file(folder / "huge.jpg", 8ull << 30);
  options.transforms_json = folder / "transforms.json";
  auto report = import();
  ASSERT_FALSE(report);
  EXPECT_FALSE(fs::exists(folder / "session"));
  put_photo("in/a.jpg", 1);
  report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 1);
  for (const char* name : {"/dev/zero", "pipe", "huge.jpg"})
    EXPECT_THAT(report->warnings, test::one_says(name));
}

TEST_F(HostileImport, WhatAKilledImportLeftIsReplaced) {
  put_photo("in/a.jpg", 1);
  options.visible = {folder / "in"};
  ASSERT_TRUE(
      SessionWriter::create(folder / "session", {{"recorded_by", "import"}}));  // and not closed
  put("session/visible/000000.jpg", "half");
  EXPECT_TRUE(import());
  EXPECT_FALSE(import()) << "a finished session stays";
  ASSERT_TRUE(SessionWriter::create(folder / "recorded", {{"recorded_by", "capture"}}));
  EXPECT_FALSE(import_session(options, folder / "recorded"));
}

TEST_F(HostileImport, ThousandsOfMissingFramesAreLookedUpByName) {
  Transforms transforms;
  for (int i = 0; i < 4000; ++i)
    transforms.frames.push_back(
        {"images/" + std::to_string(i) + ".jpg", {}, Camera::from_fov(40, 30, 50), {}});
  ASSERT_TRUE(write_transforms_json(folder / "transforms.json", transforms));
  put_photo("images/17.jpg", 1);
  options.transforms_json = folder / "transforms.json";
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->with_pose, 1);
  EXPECT_THAT(report->warnings, test::one_says("left out: 3999 files (", "images/0.jpg, ",
                                               "images/2.jpg and 3996 more): "));
  EXPECT_LT(report->warnings.size(), 5u);
}

TEST_F(HostileImport, ASessionThatWouldNotOpenIsNotWritten) {
  for (int i = 1; i <= 2; ++i)
    put_photo("in/" + std::to_string(i) + ".jpg", static_cast<std::uint64_t>(i));
  put("model/cameras.txt", "1 PINHOLE 40 30 40 40 20 15\n");
  put("model/images.txt", "1 1e200 0 0 0 1 2 3 1 1.jpg\n\n2 1 0 0 0 0 0 1 1 2.jpg\n\n");
  options.visible = {folder / "in"};
  options.visible_colmap = folder / "model";
  const auto report = import();
  ASSERT_FALSE(report);
  EXPECT_THAT(report.error().message(), test::says("1.jpg", "quaternion"));
  EXPECT_FALSE(fs::exists(folder / "session"));
}

}  // namespace
}  // namespace orbitfuse
