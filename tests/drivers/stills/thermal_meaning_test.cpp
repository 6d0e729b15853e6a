// SPDX-License-Identifier: BSD-3-Clause
// What thermal samples were taken for is said where it was guessed, and so is a scale that was
// given for nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "drivers/stills/import.hpp"
#include "tests/drivers/stills/import_files.hpp"
#include "tests/support/made_files.hpp"
#include "tests/support/says.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

class ThermalMeaning : public ImportFiles {
 protected:
  void put(const std::string& name, const std::string& bytes) {
    ImportFiles::put(name, bytes);
    options.thermal = {folder / "in"};
    fs::remove_all(folder / "session");
  }
  static cv::Mat floats(double middle, std::uint64_t seed) {
    cv::Mat image(30, 40, CV_32FC1);
    cv::RNG(seed + 1).fill(image, cv::RNG::UNIFORM, middle - 5, middle + 5);
    return image;
  }
  static std::string counts(double middle) {
    cv::Mat image(30, 40, CV_16UC1);
    cv::RNG(7).fill(image, cv::RNG::UNIFORM, middle - 200, middle + 200);
    return *encode_tiff(image, "");
  }
  ImportReport import() const {
    auto report = ImportFiles::import();
    EXPECT_TRUE(report) << report.error().message();
    return report ? std::move(*report) : ImportReport{};
  }
};

TEST_F(ThermalMeaning, CentikelvinThatCanHardlyBeIsTold) {
  put("in/a.tiff", counts(18000));  // -93 C
  EXPECT_THAT(import().warnings, test::one_says("read as centikelvin: median -9", "linear"));
  put("in/a.tiff", counts(48000));  // 207 C
  EXPECT_THAT(import().warnings, test::one_says("read as centikelvin: median 207 C"));
  put("in/a.tiff", counts(29500));
  EXPECT_THAT(import().warnings, test::none_says("read as centikelvin"));
  put("in/a.tiff", counts(18000));
  options.thermal_scale = ThermalScale::centikelvin;
  EXPECT_THAT(import().warnings, test::none_says("no scale given")) << "the user's word";
}

TEST_F(ThermalMeaning, AScaleThatIsForNothingIsTold) {
  options.thermal_scale = ThermalScale::linear;
  options.kelvin_per_count = 0.01;
  put("in/a.png", *encode_png(cv::Mat(30, 40, CV_8UC1, cv::Scalar(77))));
  EXPECT_THAT(import().warnings, test::one_says("--thermal-scale", "1 of 1 thermal files"));
  const FlirCalibration camera = made::flir_calibration();
  fs::remove(folder / "in/a.png");
  put("in/b.jpg",
      made::flir_jpeg(cv::Mat(30, 40, CV_16UC1, cv::Scalar(made::flir_signal(300, camera))),
                      camera));
  put("in/c.tiff", counts(29500));
  EXPECT_THAT(import().warnings, test::one_says("1 of 2 thermal files"));
  fs::remove(folder / "in/b.jpg");
  put("in/c.tiff", counts(29500));
  EXPECT_THAT(import().warnings, test::none_says("changes nothing"));
}

TEST_F(ThermalMeaning, FloatsAreKelvinOrCelsiusAndNanIsDead) {
  cv::Mat celsius = floats(20, 1);
  celsius.at<float>(3, 7) = std::numeric_limits<float>::quiet_NaN();
  celsius.at<float>(4, 7) = -9999;
  cv::Mat hot = floats(300, 2);
  hot.at<float>(5, 6) = 900;
  put("in/c.tiff", *encode_tiff(celsius, ""));
  options.thermal_scale = ThermalScale::centikelvin;  // of counts; they have none
  ImportReport report = import();
  ASSERT_EQ(report.thermal, 1);
  EXPECT_TRUE(report.has_temperatures);
  EXPECT_NEAR(kelvin_of(report, 0).at<float>(9, 9), celsius.at<float>(9, 9) + 273.15, 0.011);
  EXPECT_TRUE(std::isnan(kelvin_of(report, 0).at<float>(3, 7)));
  EXPECT_TRUE(std::isnan(kelvin_of(report, 0).at<float>(4, 7)));
  EXPECT_THAT(report.warnings, test::one_says("c.tiff: 32-bit floats, read as Celsius"));
  EXPECT_THAT(report.warnings, test::one_says("changes nothing in 1 of 1", "32-bit float"));
  fs::remove(folder / "in/c.tiff");
  put("in/k.tiff", *encode_tiff(hot, ""));
  put("in/l.tiff", *encode_tiff(floats(301, 3), ""));
  report = import();
  ASSERT_EQ(report.thermal, 2);
  EXPECT_NEAR(kelvin_of(report, 0).at<float>(5, 6), 900, 0.021);
  EXPECT_NEAR(kelvin_of(report, 1).at<float>(9, 9), floats(301, 3).at<float>(9, 9), 0.021);
  EXPECT_THAT(report.warnings, test::one_says("k.tiff and 1 more", "read as kelvin"));
}

/// 1e30 is some programs' word for none. The others keep their hundredths of a kelvin.
TEST_F(ThermalMeaning, FloatsThatNoScaleHoldsAreDeadAndTold) {
  cv::Mat kelvin = floats(300, 1);
  kelvin(cv::Rect(0, 0, 5, 2)).setTo(1e30f);
  kelvin.at<float>(9, 8) = std::numeric_limits<float>::infinity();
  put("in/k.tiff", *encode_tiff(kelvin, ""));
  const ImportReport report = import();
  EXPECT_THAT(report.warnings, test::one_says("k.tiff: 10 of 1200 samples have no temperature"));
  EXPECT_TRUE(std::isnan(kelvin_of(report, 0).at<float>(1, 4)));
  EXPECT_TRUE(std::isnan(kelvin_of(report, 0).at<float>(9, 8)));
  EXPECT_NEAR(kelvin_of(report, 0).at<float>(9, 9), kelvin.at<float>(9, 9), 0.0101);
}

TEST_F(ThermalMeaning, FloatsThatWouldBeTooColdAreRefusedByTheirUnit) {
  cv::Mat celsius = floats(20, 1);
  celsius(cv::Rect(0, 0, 40, 18)).setTo(3000);  // more than half
  put("in/a.tiff", *encode_tiff(celsius, ""));
  put("in/b.tiff", *encode_tiff(floats(300, 2), ""));
  EXPECT_THAT(import().warnings,
              test::one_says("left out", "a.tiff: 32-bit floats, read as kelvin", "-25"));
}

/// Read as kelvin they would be off by 273, and look like temperatures all the same.
TEST_F(ThermalMeaning, AScaleInAnotherUnitIsRefused) {
  put("in/a.tiff", counts(29500));
  cv::Mat other(30, 40, CV_16UC1);
  cv::RNG(8).fill(other, cv::RNG::UNIFORM, 7000, 7400);
  put("in/b.tiff", *encode_tiff(other, R"({"scale":0.04,"unit":"celsius"})"));
  other.at<std::uint16_t>(0, 0) = 1;
  put("in/c.tiff", *encode_tiff(other, ""));
  put("in/c.tiff.json", R"({"scale":0.04,"offset":0,"unit":"degrees C"})");
  other.at<std::uint16_t>(0, 0) = 2;
  put("in/d.tiff", *encode_tiff(other, R"({"scale":0.04,"unit":"K"})"));
  const ImportReport report = import();
  EXPECT_EQ(report.thermal, 2);
  EXPECT_THAT(report.warnings,
              test::one_says("left out", "b.tiff: \"unit\": \"celsius\"", "273.15"));
  EXPECT_THAT(report.warnings, test::one_says("left out", "c.tiff.json: \"unit\""));
}

TEST_F(ThermalMeaning, TwoScalesThatDifferAreTold) {
  cv::Mat image(30, 40, CV_16UC1);
  cv::RNG(8).fill(image, cv::RNG::UNIFORM, 7000, 7400);
  put("in/a.tiff", *encode_tiff(image, R"({"scale":0.04,"unit":"K"})"));
  const auto warnings_with = [&](const char* sidecar) {
    put("in/a.tiff.json", sidecar);
    const ImportReport report = import();
    EXPECT_NEAR(kelvin_of(report, 0).at<float>(0, 0), 0.04 * image.at<std::uint16_t>(0, 0), 0.01);
    return report.warnings;
  };
  EXPECT_THAT(warnings_with(R"({"scale":0.04,"offset":0})"), test::none_says("a.tiff"));
  EXPECT_THAT(warnings_with(R"({"scale":0.0400001,"offset":0})"), test::none_says("a.tiff"));
  EXPECT_THAT(warnings_with(R"({"scale":0.02,"offset":150})"),
              test::one_says("a.tiff", "0.04 K a count", "a.tiff.json 0.02 K", "passed over"));
  EXPECT_THAT(warnings_with(R"({"format":"of another program"})"),
              test::one_says("a.tiff", "a scale of its own"));
}

/// One camera's files are of one unit, whatever each would be taken for by itself.
TEST_F(ThermalMeaning, TheUnitOfFloatsIsDecidedForAllOfACamera) {
  for (const int i : {1, 2, 3})
    put("in/" + std::to_string(i) + ".tiff", *encode_tiff(floats(32, std::uint64_t(i)), ""));
  put("in/4.tiff", *encode_tiff(floats(212, 4), ""));
  ImportReport report = import();
  ASSERT_EQ(report.thermal, 4);
  EXPECT_NEAR(cv::mean(kelvin_of(report, 0))[0], 305.15, 0.5);
  EXPECT_NEAR(cv::mean(kelvin_of(report, 3))[0], 485.15, 0.5);
  EXPECT_THAT(report.warnings,
              test::one_says("1.tiff and 3 more: 32-bit floats, read as Celsius", "1 of 4"));
  // Most of them hot: as kelvin that would be -61 C.
  for (const int i : {2, 3})
    put("in/" + std::to_string(i) + ".tiff", *encode_tiff(floats(212, std::uint64_t(i)), ""));
  report = import();
  ASSERT_EQ(report.thermal, 4);
  EXPECT_NEAR(cv::mean(kelvin_of(report, 3))[0], 485.15, 0.5);
  // One that is none among those that are kelvin is left out, and changes nothing in them.
  for (const int i : {2, 3, 4})
    put("in/" + std::to_string(i) + ".tiff", *encode_tiff(floats(300, std::uint64_t(i)), ""));
  report = import();
  ASSERT_EQ(report.thermal, 3);
  EXPECT_NEAR(cv::mean(kelvin_of(report, 0))[0], 300, 0.5);
  EXPECT_THAT(report.warnings, test::one_says("left out", "1.tiff: 32-bit floats, read as kelvin"));
}

TEST_F(ThermalMeaning, ZerosThatMaskFloatsDecideNothing) {
  cv::Mat kelvin = floats(300, 1);
  kelvin(cv::Rect(0, 0, 40, 20)).setTo(0);
  put("in/a.tiff", *encode_tiff(kelvin, ""));
  const ImportReport report = import();
  EXPECT_TRUE(std::isnan(kelvin_of(report, 0).at<float>(9, 9)));
  EXPECT_NEAR(kelvin_of(report, 0).at<float>(25, 9), kelvin.at<float>(25, 9), 0.011);
  EXPECT_THAT(report.warnings, test::one_says("read as kelvin"));
}

TEST_F(ThermalMeaning, AStatedScaleOrUnitHoldsForFloats) {
  const cv::Mat hot = floats(212, 1);  // Celsius that look like kelvin
  const auto mean_of = [&](const cv::Mat& values, const char* words, const char* sidecar = "") {
    fs::remove(folder / "in/a.tiff.json");
    put("in/a.tiff", *encode_tiff(values, words));
    if (*sidecar) put("in/a.tiff.json", sidecar);
    const ImportReport report = import();
    EXPECT_THAT(report.warnings, test::none_says("read as"));
    return cv::mean(kelvin_of(report, 0), kelvin_of(report, 0) > 0)[0];
  };
  EXPECT_NEAR(mean_of(hot, R"({"scale":1,"offset":273.15,"unit":"kelvin"})"), 485, 1);
  EXPECT_NEAR(mean_of(hot, R"({"unit":"degrees Celsius"})"), 485, 1);
  EXPECT_NEAR(mean_of(hot, "", R"({"scale":1,"offset":273.15})"), 485, 1);
  EXPECT_NEAR(mean_of(hot, "", R"({"unit":"C"})"), 485, 1);
  EXPECT_NEAR(mean_of(floats(70, 1), R"({"unit":"F"})", R"({"scale":0.55556,"offset":255.37})"),
              294, 1);
  EXPECT_NEAR(mean_of(floats(3000, 1), R"({"scale":0.1,"offset":0,"unit":"kelvin"})"), 300, 1);
  cv::Mat masked = floats(3000, 1);
  masked(cv::Rect(0, 0, 40, 2)).setTo(0);
  EXPECT_NEAR(mean_of(masked, R"({"scale":0.01,"offset":270,"invalid":0})"), 300, 0.1);
  options.thermal_scale = ThermalScale::linear;
  options.kelvin_per_count = 1;
  options.kelvin_offset = 273.15;
  EXPECT_NEAR(mean_of(hot, ""), 485, 1);
  put("in/a.tiff", *encode_tiff(hot, ""));
  EXPECT_THAT(import().warnings, test::none_says("changes nothing"));
}

TEST_F(ThermalMeaning, WhatIsInvalidIsReadBesideAUnitAloneToo) {
  cv::Mat masked = floats(20, 1);
  masked(cv::Rect(0, 0, 40, 2)).setTo(0);
  const std::string zero = R"({"unit":"celsius","invalid":0})";
  for (const bool in_sidecar : {false, true}) {
    put("in/a.tiff", *encode_tiff(masked, in_sidecar ? "" : zero));
    if (in_sidecar) put("in/a.tiff.json", zero);
    const ImportReport report = import();
    ASSERT_EQ(report.thermal, 1);
    const cv::Mat kelvin = kelvin_of(report, 0);
    EXPECT_TRUE(std::isnan(kelvin.at<float>(1, 9))) << in_sidecar;
    EXPECT_NEAR(kelvin.at<float>(9, 9), masked.at<float>(9, 9) + 273.15, 0.011);
  }
  // Another number would become a temperature.
  put("in/b.tiff", *encode_tiff(floats(20, 2), R"({"unit":"celsius","invalid":999})"));
  put("in/c.tiff", *encode_tiff(floats(20, 3), ""));
  put("in/c.tiff.json", R"({"unit":"celsius","invalid":999})");
  cv::Mat image(30, 40, CV_16UC1);
  cv::RNG(8).fill(image, cv::RNG::UNIFORM, 29000, 29400);
  put("in/d.tiff", *encode_tiff(image, R"({"unit":"kelvin","invalid":65535})"));
  ImportReport report = import();
  EXPECT_EQ(report.thermal, 1);
  for (const char* found :
       {"b.tiff: \"invalid\": 999", "c.tiff.json: \"invalid\": 999", "d.tiff: \"invalid\": 65535"})
    EXPECT_THAT(report.warnings, test::one_says("left out", found)) << found;
  // Not even with a scale for its unit.
  put("in/b.tiff", *encode_tiff(floats(70, 2), R"({"unit":"F","invalid":999})"));
  put("in/b.tiff.json", R"({"scale":0.55556,"offset":255.37})");
  report = import();
  EXPECT_EQ(report.thermal, 1);
  EXPECT_THAT(report.warnings, test::one_says("left out", "b.tiff: \"invalid\": 999"));
}

TEST_F(ThermalMeaning, AnotherUnitIsRefusedWithoutAScaleToo) {
  put("in/a.tiff", *encode_tiff(floats(300, 1), ""));
  put("in/b.tiff", *encode_tiff(floats(70, 2), R"({"unit":"Fahrenheit"})"));
  put("in/c.tiff", *encode_tiff(floats(70, 3), R"({"scale":1,"unit":"Celsius"})"));
  cv::Mat image(30, 40, CV_16UC1);
  cv::RNG(8).fill(image, cv::RNG::UNIFORM, 29000, 29400);
  put("in/d.tiff", *encode_tiff(image, R"({"unit":"Celsius"})"));
  made::TiffWords words;
  words.gdal_metadata =
      "<GDALMetadata>\n  <Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">degF</Item>\n"
      "</GDALMetadata>\n";
  put("in/e.tiff", made::tiff_of_pages({image}, words));
  const ImportReport report = import();
  EXPECT_EQ(report.thermal, 1);
  for (const char* name : {"b.tiff: ", "c.tiff: ", "d.tiff: ", "e.tiff: "})
    EXPECT_THAT(report.warnings, test::one_says("left out", name, "\"unit\"")) << name;
}

TEST_F(ThermalMeaning, FloatsThatAreNoTemperaturesAreRefused) {
  const auto refusal_of = [&](const cv::Mat& values) {
    put("in/f.tif", *encode_tiff(values, ""));
    const auto refused = ImportFiles::import();
    return refused ? "" : refused.error().message();
  };
  for (const double middle : {-180.0, 20000.0})
    EXPECT_THAT(refusal_of(floats(middle, 1)), test::says("f.tif", "100 x kelvin")) << middle;
  const cv::Mat none(8, 9, CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_THAT(refusal_of(none), test::says("f.tif", "without one temperature"));
}

}  // namespace
}  // namespace orbitfuse
