// SPDX-License-Identifier: BSD-3-Clause
// What an import leaves out, refuses or can't use is said, and is no success where nothing is left.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <thread>

#include "core/formats/transforms_json.hpp"
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

class LeftOut : public ImportFiles {
 protected:
  void put_counts(const std::string& name, int low, int high, std::uint64_t seed) const {
    cv::Mat image(30, 40, CV_16UC1);
    cv::RNG(seed + 1).fill(image, cv::RNG::UNIFORM, low, high);
    put(name, *encode_tiff(image, ""));
  }
  void put_transforms(int width, int height, int frames) const {
    Transforms transforms;
    for (int i = 0; i < frames; ++i)
      transforms.frames.push_back(
          {"in/" + std::to_string(i) + ".jpg", {}, Camera::from_fov(width, height, 50), {}});
    ASSERT_TRUE(write_transforms_json(folder / "transforms.json", transforms));
  }
  /// The error's words; empty when there is none.
  std::string refusal() const {
    const auto report = import();
    EXPECT_FALSE(report);
    return report ? "" : report.error().message();
  }
};

TEST_F(LeftOut, OfImportsIntoOneFolderOneWinsAndKeepsItsFrames) {
  for (int i = 0; i < 4; ++i)
    put_photo("in/" + std::to_string(i) + ".jpg", static_cast<std::uint64_t>(i));
  options.visible = {folder / "in"};
  for (int round = 0; round < 10; ++round) {
    fs::remove_all(folder / "session");
    std::vector<std::optional<ErrorKind>> failures(6);
    std::vector<std::thread> imports;
    for (auto& failure : failures) {
      imports.emplace_back([&] {
        if (const auto report = import(); !report) failure = report.error().kind;
      });
    }
    for (std::thread& one : imports) one.join();
    EXPECT_EQ(std::count(failures.begin(), failures.end(), std::nullopt), 1);
    EXPECT_EQ(std::count(failures.begin(), failures.end(), ErrorKind::input), 5);
    const auto session = open_session(folder / "session");
    ASSERT_TRUE(session) << session.error().message();
    EXPECT_EQ(session->frames.size(), 4u);
    for (const FrameRecord& frame : session->frames)
      EXPECT_TRUE(fs::exists(session->path_of(frame)));
  }
}

TEST_F(LeftOut, AModalityOfWhichNothingIsLeftIsNoImport) {
  put_photo("in/a.jpg", 1);
  put_photo("text/b.jpg", 2);
  put("t/0.tif", "no picture");
  put("t/1.tif", "none either");
  options.visible = {folder / "in"};
  options.thermal = {folder / "t"};
  std::string words = refusal();
  EXPECT_THAT(words, test::says("none of the 2 thermal images", "0.tif"));
  EXPECT_FALSE(fs::exists(folder / "session"));
  put_counts("t/2.tif", 29000, 30000, 1);
  ASSERT_TRUE(import());
  fs::remove_all(folder / "session");
  put("text/b.jpg", "this is no picture");
  options.visible = {folder / "text"};
  words = refusal();
  EXPECT_THAT(words, test::says("none of the 1 visible images", "b.jpg"));
  EXPECT_THAT(words, test::says_not("give folders with")) << "one remedy: the file's own";
}

TEST_F(LeftOut, PosesOfWhichNoneFitsAreAnError) {
  for (int i = 0; i < 3; ++i)
    put_photo("in/" + std::to_string(i) + ".jpg", static_cast<std::uint64_t>(i));
  options.transforms_json = folder / "transforms.json";
  put_transforms(30, 40, 3);
  EXPECT_THAT(refusal(), test::says("not one can be used", "0.jpg", "w and h are exchanged"));
  put_transforms(40, 60, 3);
  EXPECT_THAT(refusal(), test::says_not("exchanged"));
  put_transforms(80, 60, 3);
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->with_pose, 3);
}

TEST_F(LeftOut, DotsAndRowsOfPixelsAreNoFrames) {
  put_photo("in/a.jpg", 1);
  put("in/dot.png", *encode_png(cv::Mat(1, 1, CV_8UC3, cv::Scalar(1, 2, 3))));
  put("in/row.png", *encode_png(cv::Mat(1, 40, CV_8UC3, cv::Scalar(1, 2, 3))));
  put_counts("t/a.tif", 29000, 30000, 1);
  put("t/b.tif", *encode_tiff(cv::Mat(30, 3, CV_16UC1, cv::Scalar(29000)), ""));
  options.visible = {folder / "in"};
  options.thermal = {folder / "t"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 1);
  EXPECT_EQ(report->thermal, 1);
  EXPECT_THAT(report->warnings, test::one_says("left out", "row.png", "40x1 pixels"));
  EXPECT_THAT(report->warnings, test::one_says("left out", "dot.png", "1x1 pixels"));
  EXPECT_THAT(report->warnings, test::one_says("left out", "b.tif", "3x30 pixels"));
}

TEST_F(LeftOut, AFolderOfFramesAndOfTrackingFramesIsGivenTwice) {
  put_photo("in/a.jpg", 1);
  put_counts("t/0.tif", 29000, 30000, 1);
  options.visible = {folder / "in"};
  options.visible_tracking = {folder / "in/../in"};
  EXPECT_THAT(refusal(), test::says("a.jpg", "given twice, once as a tracking frame"));
  options.visible_tracking.clear();
  options.thermal = {folder / "t"};
  options.thermal_tracking = {folder / "t/0.tif"};
  EXPECT_THAT(refusal(), test::says("0.tif", "given twice"));
  options.thermal_tracking.clear();
  EXPECT_TRUE(import());
}

TEST_F(LeftOut, AModelWithoutImagesIsAnError) {
  put_photo("in/a.jpg", 1);
  put("model/cameras.txt", "1 PINHOLE 40 30 40 40 20 15\n");
  put("model/images.txt", "");
  options.visible = {folder / "in"};
  options.visible_colmap = folder / "model";
  EXPECT_THAT(refusal(), test::says("model", "no images"));
}

TEST_F(LeftOut, ANameThatAModelHasTwiceIsNamed) {
  for (const char* name : {"in/000.jpg", "in/001.jpg"})
    put_photo(name, static_cast<std::uint64_t>(name[5]));
  put("model/cameras.txt", "1 PINHOLE 40 30 40 40 20 15\n");
  const std::string twice = "1 1 0 0 0 0 0 1 1 left/000.jpg\n\n2 1 0 0 0 0 0 1 1 right/000.jpg\n\n";
  put("model/images.txt", twice);
  options.visible = {folder / "in"};
  options.visible_colmap = folder / "model";
  EXPECT_THAT(refusal(), test::says("000.jpg is there 2 times (left, right)", "a name of its own"));
  put("model/images.txt", twice + "3 1 0 0 0 0 0 1 1 001.jpg\n\n");
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->with_pose, 1);
  EXPECT_THAT(report->warnings, test::one_says("000.jpg is there 2 times"));
}

TEST_F(LeftOut, ImagesOfOneNameAreToldApartByTheirFoldersOrNotAtAll) {
  for (const char* name : {"a/000.jpg", "b/000.jpg", "b/001.jpg"})
    put_photo(name, static_cast<std::uint64_t>(name[0] + name[4]));
  put("model/cameras.txt", "1 PINHOLE 40 30 40 40 20 15\n");
  const auto put_model = [&](const std::string& first, const std::string& second) {
    put("model/images.txt", "1 1 0 0 0 7 0 1 1 " + first + "\n\n2 1 0 0 0 8 0 1 1 " + second +
                                "\n\n3 1 0 0 0 9 0 1 1 001.jpg\n\n");
  };
  options.visible = {folder / "a", folder / "b"};
  options.visible_colmap = folder / "model";
  const auto places = [&] {
    std::map<std::string, double> x;
    const auto report = import();
    EXPECT_TRUE(report) << report.error().message();
    for (const FrameRecord& frame : report->session.frames)
      x[frame.source] = frame.cam_from_world ? frame.cam_from_world->translation.x() : 0;
    fs::remove_all(folder / "session");
    return x;
  };
  put_model("b/000.jpg", "a/000.jpg");
  const auto both = places();
  ASSERT_EQ(both.size(), 3u);
  std::vector<double> x;
  for (const auto& [source, place] : both) x.push_back(place);
  EXPECT_THAT(x, ::testing::ElementsAre(8, 7, 9)) << "a/000, b/000, b/001";
  put_model("a/000.jpg", "c/002.jpg");
  x.clear();
  for (const auto& [source, place] : places()) x.push_back(place);
  EXPECT_THAT(x, ::testing::ElementsAre(7, 0, 9)) << "b/000 is another image";
  put_model("000.jpg", "c/002.jpg");
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->with_pose, 1);
  EXPECT_THAT(report->warnings, test::one_says("has the name of another image"));
}

TEST_F(LeftOut, OneFolderThatHoldsBothOrbitsIsSharedOut) {
  for (int i = 0; i < 4; ++i) {
    cv::Mat photo(60, 80, CV_8UC3);
    cv::RNG(static_cast<std::uint64_t>(i) + 1).fill(photo, cv::RNG::UNIFORM, 0, 255);
    put(fmt::format("in/{}.png", i), *encode_png(photo));
    put_counts(fmt::format("in/{}.tif", i), 2000, 3000, static_cast<std::uint64_t>(i));
  }
  options.visible = options.thermal = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 4);
  EXPECT_EQ(report->thermal, 4);
  EXPECT_THAT(report->warnings, test::one_says("one folder given as both: its 4 thermal images"));
  EXPECT_THAT(report->warnings, test::none_says("left out"));
  EXPECT_THAT(report->warnings, test::none_says("0.png")) << "a photo is no thermal file in colour";
}

TEST_F(LeftOut, PreviewsOfThermalImagesAreNoPhotos) {
  for (int i = 0; i < 4; ++i) {
    put(fmt::format("in/{}.png", i), *encode_png(cv::Mat(30, 40, CV_8UC1, cv::Scalar(9 + i))));
    put_counts(fmt::format("in/{}.tif", i), 29300, 29700, static_cast<std::uint64_t>(i));
  }
  options.visible = options.thermal = {folder / "in"};
  EXPECT_THAT(refusal(), test::says("photos are no thermal images"));
}

TEST_F(LeftOut, ALinkToASiblingIsOneImage) {
  put_photo("in/b.jpg", 1);
  fs::create_symlink("b.jpg", folder / "in/a_latest.jpg");
  options.visible = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 1);
  EXPECT_EQ(report->session.frames.at(0).source, "in/b.jpg") << "the file, not the link";
  EXPECT_THAT(report->warnings, test::one_says("a_latest.jpg", "the same image as b.jpg"));
  options.visible = {folder / "in", folder / "in/b.jpg"};
  fs::remove_all(folder / "session");
  EXPECT_THAT(refusal(), test::says("given twice"));
}

TEST_F(LeftOut, ThermalPicturesThatAreNotReadAreNotSentThroughJpeg) {
  put("t/0.pgm", "P5");
  put("t/1.jp2", "x");
  options.thermal = {folder / "t"};
  const std::string one_kind = refusal();
  EXPECT_THAT(one_kind, test::says("16-bit TIFF or PNG"));
  EXPECT_THAT(one_kind, test::says_not("to JPEG"));
  put_counts("t/2.tif", 29000, 30000, 1);
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_THAT(report->warnings, test::one_says("0.pgm", "16-bit TIFF or PNG"));
}

TEST_F(LeftOut, FramesBeyondTheDeclaredStationsAreSaidToBeAnotherLoop) {
  for (int i = 0; i < 24; ++i)
    put_photo("in/" + std::to_string(i) + ".jpg", static_cast<std::uint64_t>(i));
  options.visible = {folder / "in"};
  options.visible_stations.emplace().spacing_deg = 25;
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_THAT(report->warnings,
              test::one_says("24 frames, but 14 stations declared",
                             "from frame 15 on they are taken for a further loop"));
  EXPECT_THAT(report->warnings, test::one_says("25 degrees don't divide the circle",
                                               "the last is 35 degrees from the first"));
  EXPECT_EQ(report->session.frames.at(14).station->loop, 1);
  EXPECT_EQ(report->session.frames.at(14).station->azimuth_deg, 0);
}

TEST_F(LeftOut, ARoundedSpacingLeavesNoGapNorDoesOneWithoutFrames) {
  for (int i = 0; i < 7; ++i)
    put_photo("in/" + std::to_string(i) + ".jpg", static_cast<std::uint64_t>(i));
  options.visible = {folder / "in"};
  options.visible_stations.emplace().spacing_deg = 51.4286;
  options.thermal_stations.emplace().spacing_deg = 25;
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_THAT(report->warnings, test::none_says("divide the circle"));
}

TEST_F(LeftOut, AThermalLensThatNothingTellsIsNotedOnce) {
  for (const char* name : {"t/0.tif", "t/1.tif"}) put_counts(name, 29000, 30000, name[2]);
  options.thermal = {folder / "t"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  ASSERT_EQ(report->notes.size(), 1u);
  EXPECT_NE(report->notes[0].find("--thermal-focal-px"), std::string::npos);
  std::filesystem::remove_all(folder / "session");
  options.thermal_focal_px = 500;
  EXPECT_TRUE(import()->notes.empty());
}

TEST_F(LeftOut, AVisibleLensThatNothingTellsIsNotedAndSoIsAPhotoAlone) {
  put_photo("in/0.jpg", 0);
  options.visible = {folder / "in"};
  auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_THAT(report->notes, test::one_says("--visible-focal-px", "finds it from the images"));
  EXPECT_THAT(report->warnings, test::one_says("one visible frame alone can't be posed"));
  std::filesystem::remove_all(folder / "session");
  put_photo("in/1.jpg", 1);
  options.visible_focal_px = 500;
  report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->notes.empty());
  EXPECT_THAT(report->warnings, test::none_says("can't be posed"));
}

TEST_F(LeftOut, StationsOfWhatWasNotGivenAreNoWarningAndARigOfOneCameraIs) {
  for (int i = 0; i < 12; ++i)
    put_photo("in/" + std::to_string(i) + ".jpg", static_cast<std::uint64_t>(i));
  options.visible = {folder / "in"};
  options.visible_stations = options.thermal_stations = DeclaredStations{};
  options.rig = true;
  auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_THAT(report->warnings, test::none_says("stations declared"));
  EXPECT_THAT(report->warnings, test::one_says("rig", "no pairs"));
  put_counts("t/0.tif", 29000, 30000, 1);
  options.thermal = {folder / "t"};
  fs::remove_all(folder / "session");
  report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_THAT(report->warnings, test::one_says("thermal: 1 frames"));
  EXPECT_THAT(report->warnings, test::one_says("12 visible and 1 thermal frames"));
}

/// They may be previews, which no tag calls so, or another camera's images.
TEST_F(LeftOut, PagesOfAnotherSizeOrKindAreNamed) {
  const auto page = [](int width, int type, std::uint64_t seed) {
    cv::Mat image(30, width, type);
    cv::RNG(seed).fill(image, cv::RNG::UNIFORM, type == CV_8UC1 ? 0 : 29300,
                       type == CV_8UC1 ? 255 : 29700);
    return image;
  };
  const auto counts = [&](std::uint64_t seed) { return page(40, CV_16UC1, seed); };
  put("t/0.tif",
      made::tiff_of_pages({counts(1), page(20, CV_16UC1, 2), counts(3), page(40, CV_8UC1, 4)},
                          R"({"scale":0.01})"));
  put("t/1.tif", made::tiff_of_pages({counts(5), counts(6)}, R"({"scale":0.01})"));
  put("in/2.tif", made::tiff_of_pages({page(40, CV_8UC1, 7), page(80, CV_8UC1, 8)}));
  std::vector<cv::Mat> many{page(40, CV_8UC1, 9)};
  for (int width = 50; width < 70; ++width) many.push_back(page(width, CV_8UC1, 10));
  put("in/3.tif", made::tiff_of_pages(many));
  options.visible = {folder / "in"};
  options.thermal = {folder / "t"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->thermal, 4);
  EXPECT_EQ(report->visible, 2);
  EXPECT_THAT(report->warnings,
              test::one_says("left out: ", "t/0.tif: pages 2 (20x30, 16-bit), 4 (40x30, 8-bit), "));
  EXPECT_THAT(report->warnings, test::one_says("in/2.tif: page 2 (80x30, 8-bit), "));
  EXPECT_THAT(report->warnings,
              test::one_says("in/3.tif: pages 2 (50x30, 8-bit), 3 (51x30, 8-bit), 4 (52x30, 8-bit) "
                             "and 17 more, "));
  EXPECT_THAT(report->warnings, test::none_says("t/1.tif"));
}

/// A camera's program that puts a preview into each of its files; raw photos beside each JPEG.
TEST_F(LeftOut, WhatIsTheSameOfManyFilesIsToldOnce) {
  cv::Mat preview(15, 20, CV_8UC1, cv::Scalar(7)), image(30, 40, CV_16UC1);
  for (int i = 0; i < 40; ++i) {
    const std::string number = std::to_string(100 + i);
    cv::RNG(static_cast<std::uint64_t>(i) + 1).fill(image, cv::RNG::UNIFORM, 29300, 29700);
    image.at<std::uint16_t>(0, 0) = 65535;
    if (i % 2) image.at<std::uint16_t>(0, 1) = 65535;
    put("t/" + number + ".tif", made::tiff_of_pages({image, preview}, R"({"scale":0.01})"));
    put("t/copy" + number + ".tif", made::tiff_of_pages({image, preview}, R"({"scale":0.01})"));
    put("t/cut" + number + ".tif", "II*" + std::string(static_cast<std::size_t>(i), 'x'));
    put_photo("in/" + number + ".jpg", static_cast<std::uint64_t>(i));
    put("in/" + number + ".dng", "raw");
    fs::create_symlink(folder / "nothing", folder / ("in/" + number + "x.jpg"));
  }
  put("in/one.webp", "x");
  options.visible = {folder / "in"};
  options.thermal = {folder / "t"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->thermal, 40);
  EXPECT_EQ(report->visible, 40);
  for (const char* words :
       {"t/102.tif and 37 more): page 2 (20x15, 8-bit)", "and 37 more): the same image as",
        "cut102.tif and 37 more): ", "t/102.tif and 37 more): 1 of 1200 samples",
        "102.dng and 37 more): raw photo files", "and 37 more): no file"})
    EXPECT_THAT(report->warnings, test::one_says("40 files (", words));
  EXPECT_THAT(report->warnings, test::one_says("1 of 1200 samples", "of the others likewise"));
  EXPECT_THAT(report->warnings, test::one_says("left out: ", "one.webp: web image files"));
  EXPECT_LT(report->warnings.size(), 10u);
}

/// Hundreds of names are no message.
TEST_F(LeftOut, OfManyImagesWithTransparentPixelsTheFirstAreNamed) {
  for (int i = 10; i < 30; ++i) {
    cv::Mat image(30, 40, CV_8UC4);
    cv::RNG(static_cast<std::uint64_t>(i)).fill(image, cv::RNG::UNIFORM, 0, 255);
    put("in/" + std::to_string(i) + ".png", *encode_png(image));
  }
  options.visible = {folder / "in"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 20);
  EXPECT_THAT(report->warnings, test::one_says("20 images have transparent pixels: ", "in/10.png (",
                                               "in/12.png (", " %) and 17 more; alpha"));
  EXPECT_THAT(report->warnings, test::none_says("in/13.png"));
}

/// Which of the two is meant nobody knows.
TEST_F(LeftOut, ASidecarWithAKeyTwiceIsNamed) {
  for (const char* name : {"t/0.tif", "t/1.tif"}) put_counts(name, 29000, 30000, name[2]);
  put("t/1.tif.json", "{\"scale\": 0.01,\n \"scale\": 0.04}");
  cv::Mat image(30, 40, CV_16UC1, cv::Scalar(29500));
  put("t/2.tif", made::tiff_of_pages({image}, R"({"scale":0.01,"offset":0,"offset":273.15})"));
  options.thermal = {folder / "t"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->thermal, 1);
  EXPECT_THAT(report->warnings,
              test::one_says("left out", "1.tif.json", "key \"scale\" twice", "line 2"));
  EXPECT_THAT(report->warnings, test::one_says("left out", "2.tif", "key \"offset\" twice"));
}

/// As cameras, computers and programs leave them.
TEST_F(LeftOut, WhatLiesBesideAndBelowTheImagesIsNamedOrNotTakenForOne) {
  put_photo("in/a.jpg", 1);
  put_photo("in/b.JPE", 2);
  put_photo("in/c.jfif", 3);
  put("in/._a.jpg", "of a Mac");
  put("in/d.mpo", "x");
  put("in/log.csv", "x");
  put_photo("in/more/d.jpg", 4);
  put_photo("in/small/e.jpg", 5);
  put("in/empty/._f.jpg", "x");
  put_counts("t/0.tif", 29000, 30000, 1);
  put("t/1.csv", "25.0,25.1");
  options.visible = {folder / "in"};
  options.thermal = {folder / "t"};
  options.visible_stations = DeclaredStations{};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 3);
  EXPECT_EQ(report->session.frames_of(Modality::visible)[0]->station->index, 0);
  EXPECT_THAT(report->warnings, test::one_says("left out: the images in", "and 1 more folders"));
  EXPECT_THAT(report->warnings, test::one_says("left out", "d.mpo"));
  EXPECT_THAT(report->warnings, test::one_says("left out", "1.csv: table files", "16-bit TIFF"));
  for (const char* silent : {"._a.jpg", "log.csv", "empty"})
    EXPECT_THAT(report->warnings, test::none_says(silent));
  fs::remove(folder / "t/0.tif");
  fs::remove_all(folder / "session");
  EXPECT_THAT(refusal(), test::says("1 of another format (1.csv)", "16-bit TIFF"));
}

}  // namespace
}  // namespace orbitfuse
