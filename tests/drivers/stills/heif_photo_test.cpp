// SPDX-License-Identifier: BSD-3-Clause
// Photos of phones. The test files are made by libheif's own encoder.
#include "drivers/stills/heif_photo.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "drivers/stills/import.hpp"
#include "tests/support/made_files.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// Four colours, so that every turn and mirror image differs.
cv::Mat quarters(cv::Size size = {96, 64}) {
  cv::Mat image(size, CV_8UC3, cv::Scalar(20, 20, 20));
  const int w = size.width / 2, h = size.height / 2;
  image(cv::Rect(0, 0, w, h)) = cv::Scalar(40, 40, 220);
  image(cv::Rect(w, 0, w, h)) = cv::Scalar(40, 220, 40);
  image(cv::Rect(0, h, w, h)) = cv::Scalar(220, 40, 40);
  cv::GaussianBlur(image, image, {}, 1);
  return image;
}

double mean_difference(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size()) return 255;
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(3 * a.total());
}

class HeifPhoto : public ::testing::Test {
 protected:
  void SetUp() override {
    if (made::heic(quarters()).empty()) GTEST_SKIP() << "libheif has no HEVC encoder here";
  }
  test::TempFolder folder;
};

TEST_F(HeifPhoto, IsReadUprightInEveryOrientation) {
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const std::string bytes = made::heic(quarters(), orientation, made::exif_block(orientation));
    ASSERT_TRUE(is_heif(bytes));
    const auto image = decode_heif(bytes, "f");
    ASSERT_TRUE(image) << image.error().message();
    EXPECT_LT(mean_difference(*image, apply_orientation(quarters(), orientation)), 4)
        << orientation;
    const ExifInfo exif = heif_exif(bytes);
    EXPECT_EQ(exif.orientation, 1) << "turned already";
    EXPECT_EQ(exif.focal_35mm, 26);
    EXPECT_EQ(exif.taken_ns, 1'714'979'289'000'000'000);
  }
}

TEST_F(HeifPhoto, OfAClockThatNobodySetHasNoTime) {
  std::string exif = made::exif_block(1);
  exif.replace(exif.find("2024:05:06 07:08:09"), 19, "1970:01:01 00:00:00");
  const ExifInfo read = heif_exif(made::heic(quarters(), 1, exif));
  EXPECT_EQ(read.focal_35mm, 26);
  EXPECT_FALSE(read.taken_ns);
}

TEST_F(HeifPhoto, IsImportedAsAnUprightJpegWithFocalLengthAndTime) {
  test::put(folder / "in/IMG_1.HEIC", made::heic(quarters(), 6, made::exif_block(6)));
  test::put(folder / "in/IMG_2.heic", made::heic(quarters({128, 96}), 1));
  ImportOptions options;
  options.visible = {folder / "in"};
  const auto report = import_session(options, folder / "session");
  ASSERT_TRUE(report) << report.error().message();
  ASSERT_EQ(report->visible, 2);
  const Session& session = report->session;
  const FrameRecord& first = session.frames.at(0);
  EXPECT_EQ(first.file, "visible/000000.jpg");
  EXPECT_THAT(first.source, HasSubstr("IMG_1.HEIC"));
  EXPECT_EQ(cv::Size(first.width, first.height), cv::Size(64, 96));
  EXPECT_EQ(first.host_time_ns, 1'714'979'289'000'000'000);
  const auto image = read_visible(session.path_of(first));
  ASSERT_TRUE(image);
  EXPECT_LT(mean_difference(*image, apply_orientation(quarters(), 6)), 5);
  const DeviceInfo* device = session.device(first.device);
  ASSERT_TRUE(device && device->lens.focal_px);
  EXPECT_NEAR(*device->lens.focal_px, 26 * std::hypot(96, 64) / 43.2666, 0.01);
}

TEST_F(HeifPhoto, WhatIsCutOrDamagedIsNamed) {
  const std::string whole = made::heic(quarters({256, 192}), 1, made::exif_block(1));
  for (const double share : {0.02, 0.3, 0.7, 0.95}) {
    const auto image = decode_heif(
        std::string_view(whole).substr(0, static_cast<std::size_t>(share * double(whole.size()))),
        "f");
    EXPECT_FALSE(image) << share;
  }
  test::put(folder / "in/good.heic", whole);
  test::put(folder / "in/cut.heic", whole.substr(0, whole.size() / 2));
  test::put(folder / "in/not.heic", "no HEIC at all");
  ImportOptions options;
  options.visible = {folder / "in"};
  const auto report = import_session(options, folder / "session");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 1);
  for (const char* name : {"cut.heic", "not.heic"})
    EXPECT_THAT(report->warnings, Contains(AllOf(HasSubstr("left out"), HasSubstr(name))));
}

/// As of PNG, TIFF and BMP: the photo is stored as JPEG, which has none.
TEST_F(HeifPhoto, TransparentPixelsAreNamed) {
  cv::Mat image;
  cv::cvtColor(quarters(), image, cv::COLOR_BGR2BGRA);
  test::put(folder / "in/opaque.heic", made::heic(image));
  image(cv::Rect(0, 0, 48, 64)).setTo(cv::Scalar(40, 90, 120, 0));
  test::put(folder / "in/half.heic", made::heic(image));
  ImportOptions options;
  options.visible = {folder / "in"};
  const auto report = import_session(options, folder / "session");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->visible, 2);
  EXPECT_THAT(report->warnings, Contains(AllOf(HasSubstr("transparent pixels: in/half.heic (5"),
                                               Not(HasSubstr("opaque.heic")))));
  const auto stored = read_visible(report->session.path_of(report->session.frames.at(0)));
  ASSERT_TRUE(stored) << stored.error().message();
  EXPECT_EQ(stored->type(), CV_8UC3);
}

TEST(HeifPhotoBytes, NothingAndOtherBrandsAreNone) {
  EXPECT_FALSE(is_heif(""));
  EXPECT_FALSE(
      is_heif(std::string("\0\0\0\x18"
                          "ftypisom",
                          12)));
  EXPECT_FALSE(decode_heif("", "f"));
  EXPECT_EQ(heif_exif("").orientation, 1);
}

}  // namespace
}  // namespace orbitfuse
