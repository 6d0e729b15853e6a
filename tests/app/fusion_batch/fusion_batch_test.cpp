// SPDX-License-Identifier: BSD-3-Clause
#include "app/fusion_batch/fusion_batch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "core/image/image_io.hpp"
#include "fusion/metrics/metrics.hpp"
#include "tests/support/made_files.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::batch {
namespace {
namespace fs = std::filesystem;

cv::Mat noise(cv::Size size, int type, std::uint64_t seed) {
  cv::Mat image(size, type);
  cv::RNG random(seed);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

cv::Mat1f warm_scene(cv::Size size) {
  cv::Mat1f kelvin(size);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      kelvin(y, x) = 290 + 0.2F * static_cast<float>(x) + std::sin(static_cast<float>(y));
  return kelvin;
}

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

class FusionBatch : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* folder : {"v", "t"}) fs::create_directories(temp.path() / folder);
    ASSERT_TRUE(write_png(temp.path() / "v/a.png", noise({40, 32}, CV_8UC3, 1)));
    ASSERT_TRUE(write_png(temp.path() / "t/a.png", noise({40, 32}, CV_8UC1, 2)));
    ASSERT_TRUE(write_png(temp.path() / "v/b.png", noise({40, 32}, CV_8UC3, 3)));
    ASSERT_TRUE(write_thermal_tiff(temp.path() / "t/b.tiff", warm_scene({40, 32})));
  }
  Result<Summary> run(const Progress& progress = {}) {
    return fuse_folder(temp.path() / "v", temp.path() / "t", temp.path() / "out", {}, progress);
  }
  test::TempFolder temp;
};

TEST_F(FusionBatch, ThermalPicturesInColoursAreToldOnce) {
  cv::Mat gray3;
  cv::cvtColor(noise({40, 32}, CV_8UC1, 2), gray3, cv::COLOR_GRAY2BGR);
  ASSERT_TRUE(write_png(temp.path() / "t/a.png", gray3));
  EXPECT_TRUE(run()->remarks.empty()) << "gray, stored as three channels";
  fs::remove(temp.path() / "t/b.tiff");
  const cv::Mat colors = noise({40, 32}, CV_8UC3, 4);
  cv::Mat deeper;
  colors.convertTo(deeper, CV_16U, 257);
  ASSERT_TRUE(write_png(temp.path() / "t/a.png", colors));
  ASSERT_TRUE(write_png(temp.path() / "t/b.png", deeper));
  const auto told = run();
  ASSERT_TRUE(told);
  ASSERT_EQ(told->remarks.size(), 1u);
  EXPECT_NE(told->remarks[0].find("a.png and 1 more thermal images: in colour"), std::string::npos)
      << told->remarks[0];
}

TEST_F(FusionBatch, WritesTheLayoutAndTheScores) {
  int reports = 0;
  Progress progress;
  progress.report = [&](const ProgressEvent& event) {
    ++reports;
    EXPECT_EQ(event.total, 2);
  };
  const auto summary = run(progress);
  ASSERT_TRUE(summary) << summary.error().message();
  EXPECT_EQ(summary->fused, 2);
  EXPECT_TRUE(summary->problems.empty());
  EXPECT_EQ(reports, 2);
  for (const char* stem : {"a.png", "b.png"})
    for (const char* folder : {"vi", "ir", "fused"})
      EXPECT_EQ(read_image(temp.path() / "out" / folder / stem).value().size(), cv::Size(40, 32))
          << folder << stem;
  const std::string csv = text_of(temp.path() / "out" / metrics_file);
  EXPECT_EQ(csv.find("pair,method,metric,value\na,best,MV,"), 0U);
  const auto values = fusion_metrics(read_image(temp.path() / "out/vi/a.png").value(),
                                     read_image(temp.path() / "out/ir/a.png").value(),
                                     read_image(temp.path() / "out/fused/a.png").value())
                          .value();
  EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')),
            1 + 2 * values.size());
}

TEST_F(FusionBatch, RadiometricImagesAreSpreadOverTheirTemperatures) {
  ASSERT_TRUE(run());
  const cv::Mat gray = read_image(temp.path() / "out/ir/b.png").value();
  ASSERT_EQ(gray.type(), CV_8UC1);
  double low = 0, high = 0;
  cv::minMaxLoc(gray, &low, &high);
  EXPECT_LT(low, 5);
  EXPECT_GT(high, 250);
  EXPECT_EQ(read_thermal(temp.path() / "t/b.tiff").value().type(), CV_32FC1);
  EXPECT_EQ(read_thermal(temp.path() / "t/a.png").value().type(), CV_8UC1);
}

TEST_F(FusionBatch, BadPairsAreToldAndLeftOut) {
  ASSERT_TRUE(write_png(temp.path() / "v/alone.png", noise({40, 32}, CV_8UC1, 5)));
  ASSERT_TRUE(write_png(temp.path() / "v/odd.png", noise({40, 32}, CV_8UC1, 6)));
  ASSERT_TRUE(write_png(temp.path() / "t/odd.png", noise({41, 32}, CV_8UC1, 7)));
  std::ofstream(temp.path() / "v/torn.png") << "no image";
  std::ofstream(temp.path() / "t/torn.png") << "no image";
  const auto summary = run();
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->fused, 2);
  ASSERT_EQ(summary->problems.size(), 3U);
  EXPECT_NE(summary->problems[0].find("alone.png"), std::string::npos);
  EXPECT_NE(summary->problems[1].find("41x32"), std::string::npos);
  EXPECT_NE(summary->problems[2].find("torn"), std::string::npos);
  EXPECT_FALSE(fs::exists(temp.path() / "out/fused/odd.png"));
}

TEST_F(FusionBatch, ImagesOfOneNameAreNotWrittenOverEachOther) {
  ASSERT_TRUE(write_jpeg(temp.path() / "v/a.jpg", noise({40, 32}, CV_8UC3, 8)));
  ASSERT_TRUE(write_png(temp.path() / "t/alone.png", noise({40, 32}, CV_8UC1, 9)));
  const auto summary = run();
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->fused, 1);
  EXPECT_FALSE(fs::exists(temp.path() / "out/fused/a.png"));
  ASSERT_EQ(summary->problems.size(), 2U);
  EXPECT_NE(summary->problems[0].find("a.jpg: a.png is another image of that name"),
            std::string::npos);
  EXPECT_NE(summary->problems[1].find("alone.png: no visible image"), std::string::npos);
}

TEST_F(FusionBatch, NothingToFuseAndCancellingAreErrors) {
  const auto missing =
      fuse_folder(temp.path() / "v", temp.path() / "nowhere", temp.path() / "out", {}, {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, ErrorKind::input);
  fs::create_directories(temp.path() / "empty");
  EXPECT_FALSE(fuse_folder(temp.path() / "empty", temp.path() / "t", temp.path() / "out", {}, {}));
  std::atomic<bool> stop = true;
  Progress progress;
  progress.cancel = &stop;
  EXPECT_FALSE(run(progress));
}

/// As an import turns it, and as the photo beside it is.
TEST_F(FusionBatch, ThermalImagesAreTurnedAsTheirTagSays) {
  const test::TempFolder own;
  cv::Mat counts(30, 40, CV_16UC1, cv::Scalar(29000));
  counts(cv::Rect(0, 0, 10, 10)) += 2000;
  made::TiffWords words;
  words.description = R"({"scale":0.01})";
  words.orientation = 6;
  test::put(own / "t.tif", made::tiff_of_pages({counts}, words));
  const auto kelvin = read_thermal(own / "t.tif");
  ASSERT_TRUE(kelvin) << kelvin.error().message();
  ASSERT_EQ(kelvin->size(), cv::Size(30, 40));
  EXPECT_NEAR(kelvin->at<float>(5, 25), 310, 0.01);
  EXPECT_NEAR(kelvin->at<float>(5, 5), 290, 0.01);
  // Not as that of a preview in front of it does.
  words.subfile_of_first = words.orientation_of_first = 1;
  const cv::Mat preview(3, 4, CV_8UC1, cv::Scalar(1));
  test::put(own / "p.tif", made::tiff_of_pages({preview, counts}, words));
  EXPECT_EQ(read_thermal(own / "p.tif")->size(), cv::Size(30, 40));
}

}  // namespace
}  // namespace orbitfuse::batch
