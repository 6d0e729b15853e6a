// SPDX-License-Identifier: BSD-3-Clause
// Files as other cameras and programs leave them: what is damaged is named, what is meant is read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/imgproc.hpp>

#include "core/image/exif.hpp"
#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "drivers/stills/flir_jpeg.hpp"
#include "tests/drivers/stills/import_files.hpp"
#include "tests/support/made_files.hpp"
#include "tests/support/says.hpp"

namespace orbitfuse {
namespace {

using namespace std::string_literals;

constexpr std::uint32_t exif_time_s = 1'714'979'289;  // of made::exif_block()
constexpr std::int64_t one_s = 1'000'000'000;

void put_little(std::string& to, std::size_t at, std::uint64_t value, std::size_t bytes) {
  if (to.size() < at + bytes) to.resize(at + bytes);
  for (std::size_t i = 0; i < bytes; ++i) to[at + i] = static_cast<char>(value >> (8 * i));
}

/// An uncompressed BigTIFF of one grey image, or of two bands; `format`: 1 unsigned, 2 signed, 3
/// float.
std::string big_tiff(const cv::Mat& image, int format, int orientation) {
  std::string out("II\x2b\0\x08\0\0\0\0\0\0\0\0\0\0\0", 16);
  const std::uint64_t bytes = image.total() * image.elemSize();
  const auto channels = static_cast<std::uint64_t>(image.channels());
  out.append(reinterpret_cast<const char*>(image.data), bytes);
  const std::size_t directory = out.size();
  put_little(out, 8, directory, 8);
  const std::pair<std::uint64_t, std::uint64_t> entries[] = {
      {256, static_cast<std::uint64_t>(image.cols)},
      {257, static_cast<std::uint64_t>(image.rows)},
      {258, 8 * image.elemSize1() * (channels == 2 ? 0x10001 : 1)},
      {259, 1},
      {262, 1},
      {273, 16},
      {274, static_cast<std::uint64_t>(orientation)},
      {277, channels},
      {278, static_cast<std::uint64_t>(image.rows)},
      {279, bytes},
      {339, static_cast<std::uint64_t>(format)}};
  put_little(out, directory, std::size(entries), 8);
  for (std::size_t i = 0; i < std::size(entries); ++i) {
    const std::size_t at = directory + 8 + 20 * i;
    const bool is_long = entries[i].first == 273 || entries[i].first == 279;
    put_little(out, at, entries[i].first, 2);
    put_little(out, at + 2, is_long ? 16 : 3, 2);
    put_little(out, at + 4, entries[i].first == 258 ? channels : 1, 8);
    put_little(out, at + 12, entries[i].second, 8);
  }
  put_little(out, out.size(), 0, 8);
  return out;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, text.npos);
  return at == text.npos ? text : text.replace(at, from.size(), to);
}

std::string with_exif_block(const std::string& jpeg, const std::string& exif) {
  const std::string block = "Exif\0\0"s + exif;
  std::string out = jpeg.substr(0, 2) + "\xff\xe1";
  out += static_cast<char>((block.size() + 2) >> 8);
  out += static_cast<char>((block.size() + 2) & 0xff);
  return out + block + jpeg.substr(2);
}

class OtherCameras : public ImportFiles {
 protected:
  static cv::Mat noise(int type, double low, double high, std::uint64_t seed) {
    cv::Mat image(30, 40, type);
    cv::RNG(seed + 1).fill(image, cv::RNG::UNIFORM, low, high);
    return image;
  }
  static cv::Mat counts(std::uint64_t seed) { return noise(CV_16UC1, 29300, 29700, seed); }
  static std::string photo(std::uint64_t seed) {
    return *encode_jpeg(noise(CV_8UC3, 0, 255, seed), 90);
  }
  /// Of one temperature, as a recording holds it.
  std::string shot(double kelvin) const {
    return made::flir_file(cv::Mat(30, 40, CV_16UC1, cv::Scalar(made::flir_signal(kelvin, camera))),
                           camera, made::FlirPixels::raw, {});
  }
  std::string flir_taken_at(std::uint32_t seconds, int zone_minutes) const {
    std::string jpeg = made::flir_jpeg(
        cv::Mat(30, 40, CV_16UC1, cv::Scalar(made::flir_signal(300, camera))), camera);
    std::string made_at;
    put_little(made_at, 0, 1'700'000'000, 4);
    const std::size_t at = jpeg.find(made_at);
    EXPECT_NE(at, jpeg.npos);
    put_little(jpeg, at, seconds, 4);
    put_little(jpeg, at + 8, static_cast<std::uint64_t>(zone_minutes), 2);
    return jpeg;
  }
  /// Of the files in t/, as thermal ones.
  ImportReport imported() {
    options.thermal = {folder / "t"};
    return report_of();
  }
  ImportReport imported_photos() {
    options.visible = {folder / "in"};
    return report_of();
  }
  ImportReport report_of() {
    std::filesystem::remove_all(folder / "session");
    auto report = import();
    EXPECT_TRUE(report) << report.error().message();
    return report ? std::move(*report) : ImportReport{};
  }

  FlirCalibration camera = made::flir_calibration();
};

TEST_F(OtherCameras, PagesBehindACutAreNamed) {
  const std::vector<cv::Mat> pages{counts(1), counts(2), counts(3), counts(4)};
  const std::string whole = made::tiff_of_pages(pages);
  for (const std::size_t kept : {1ul, 3ul}) {
    const std::size_t size =
        made::tiff_of_pages(std::vector<cv::Mat>(pages.begin(), pages.begin() + long(kept))).size();
    for (const std::size_t more : {0ul, 100ul}) {
      put("t/rec.tif", whole.substr(0, size + more));
      const ImportReport report = imported();
      EXPECT_EQ(report.thermal, static_cast<int>(kept));
      EXPECT_THAT(
          report.warnings,
          test::one_says("left out",
                         "t/rec.tif: all pages from " + std::to_string(kept + 1) + " on", "cut"));
    }
  }
  put("t/rec.tif", whole);
  EXPECT_THAT(imported().warnings, test::none_says("left out"));
}

TEST_F(OtherCameras, DamagedImagesOfARecordingAreNamedAndTheOthersKept) {
  std::vector<std::string> shots;
  for (const double kelvin : {300, 310, 320, 330, 340}) shots.push_back(shot(kelvin));
  const auto put_recording = [&](std::vector<std::string> images) {
    std::string all;
    for (const std::string& image : images) all += image;
    put("t/walk.seq", all);
  };
  const auto damaged = [&](std::size_t at, const std::string& bytes, std::size_t image = 2) {
    std::vector<std::string> images = shots;
    images[image].replace(at, bytes.size(), bytes);
    return images;
  };
  const std::vector<std::vector<std::string>> recordings{
      damaged(0, "XXXX"), damaged(0x14, "\xff\xff\xff\xff"), damaged(0x1c, "\x00\x0f\0\0"s),
      damaged(64 + 0x10, "\x7f\0\0\0"s), damaged(64 + 0x10, "\0\0\x1c\0"s)};
  for (const auto& images : recordings) {
    put_recording(images);
    const ImportReport report = imported();
    ASSERT_EQ(report.thermal, 4);
    EXPECT_NEAR(kelvin_of(report, 1).at<float>(9, 9), 310, 0.1);
    EXPECT_NEAR(kelvin_of(report, 2).at<float>(9, 9), 330, 0.1);
    EXPECT_THAT(report.warnings, test::one_says("left out", "walk.seq (image 3): "));
  }
  put_recording(damaged(0x14, "\xff\xff\xff\xff", 0));
  ImportReport report = imported();
  EXPECT_EQ(report.thermal, 4);
  EXPECT_THAT(report.warnings, test::one_says("left out", "walk.seq (image 1): "));
  for (const std::size_t left : {30ul, 100ul, 600ul}) {
    std::vector<std::string> images = shots;
    images[4].resize(left);
    put_recording(images);
    report = imported();
    EXPECT_EQ(report.thermal, 4) << left;
    EXPECT_THAT(report.warnings, test::one_says("left out", "walk.seq (image 5): ")) << left;
  }
  std::vector<std::string> two = damaged(0, "XXXX");
  two[3].replace(0, 4, "XXXX");
  put_recording(two);
  report = imported();
  EXPECT_EQ(report.thermal, 3);
  EXPECT_THAT(report.warnings, test::one_says("walk.seq (image 4): "));
}

TEST_F(OtherCameras, RoomBetweenTheImagesOfARecordingIsNoDamage) {
  std::string all;
  for (const double kelvin : {300, 310, 320}) all += shot(kelvin) + std::string(1000, '\0');
  put("t/walk.seq", all + std::string(9000, '\0'));
  const ImportReport report = imported();
  EXPECT_EQ(report.thermal, 3);
  EXPECT_THAT(report.warnings, test::none_says("left out"));
}

TEST_F(OtherCameras, TheSecondOfTwoBandsIsNotDroppedUnsaid) {
  const cv::Mat two_bands = noise(CV_16UC2, 29300, 29700, 1);
  const auto image = decode_tiff(big_tiff(two_bands, 1, 1), "b.tif");
  ASSERT_FALSE(image);
  EXPECT_THAT(image.error().message(), test::says("b.tif", "2 samples a pixel", "gdal_translate"));
}

TEST_F(OtherCameras, ABigTiffIsHeldAsItsTagSays) {
  const std::string bytes = big_tiff(noise(CV_8UC1, 0, 255, 1), 1, 6);
  EXPECT_EQ(read_exif(bytes).orientation, 6);
  put("t/a.tif", bytes);
  const ImportReport report = imported();
  ASSERT_EQ(report.thermal, 1);
  EXPECT_EQ(report.session.frames[0].width, 30);
}

TEST_F(OtherCameras, FloatsOf64BitsAreReadAndOtherSamplesHaveARemedyThatKeepsTemperatures) {
  const cv::Mat kelvin = noise(CV_64FC1, 295, 305, 1);
  put("t/a.tif", big_tiff(kelvin, 3, 1));
  const ImportReport report = imported();
  ASSERT_EQ(report.thermal, 1);
  EXPECT_NEAR(kelvin_of(report, 0).at<float>(9, 9), kelvin.at<double>(9, 9), 0.0101);
  for (const int format : {2, 3}) {
    const auto refused = decode_tiff(big_tiff(counts(1), format, 1), "s.tif");
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message(), test::says("32-bit floats (kelvin or Celsius)"));
  }
}

TEST_F(OtherCameras, AWholeJpegOfAnUnreadKindIsNotCalledDamaged) {
  const std::string jpeg = photo(1);
  const std::size_t frame = jpeg.find("\xff\xc0");
  ASSERT_NE(frame, jpeg.npos);
  std::string twelve_bits = jpeg;
  twelve_bits[frame + 4] = 12;
  const auto refused = decode_jpeg(twelve_bits, "j.jpg");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message(), test::says("a kind of JPEG that is not read", "PNG"));
  EXPECT_THAT(refused.error().message(), test::says_not("damaged"));
  EXPECT_TRUE(decode_jpeg(jpeg, "j.jpg"));
}

TEST_F(OtherCameras, PhotosOfWhichSomeTellTheirOffsetComeInOrder) {
  const auto taken = [](const std::string& time, bool with_offset) {
    std::string block = replaced(made::exif_block(1), "07:08:09", time);
    if (with_offset) {
      block = replaced(block, "\x0a\x92\x05\0\x01\0\0\0"s, "\x11\x90\x02\0\x07\0\0\0"s);
      block.replace(100, 7, "+02:00\0"s);
    }
    return block;
  };
  put("in/c.jpg", with_exif_block(photo(1), taken("10:00:00", false)));
  put("in/b.jpg", with_exif_block(photo(2), taken("10:05:00", true)));
  put("in/a.jpg", with_exif_block(photo(3), taken("10:10:00", false)));
  const ImportReport report = imported_photos();
  ASSERT_EQ(report.visible, 3);
  EXPECT_EQ(report.session.frames[0].source, "in/c.jpg");
  EXPECT_EQ(report.session.frames[1].source, "in/b.jpg");
  EXPECT_EQ(report.session.frames[2].source, "in/a.jpg");
  EXPECT_EQ(*report.session.frames[1].host_time_ns - *report.session.frames[0].host_time_ns,
            300 * one_s);
}

TEST_F(OtherCameras, AScaleOnTheFirstPageIsThatOfPagesWithoutOne) {
  const std::string tag = R"({"scale":0.04,"offset":0})";
  const std::vector<cv::Mat> pages{noise(CV_16UC1, 7300, 7500, 1), noise(CV_16UC1, 7300, 7500, 2)};
  std::string bytes = made::tiff_of_pages(pages, tag);
  bytes.replace(bytes.rfind(tag), tag.size(), std::string(tag.size(), ' '));
  put("t/rec.tif", bytes);
  const ImportReport report = imported();
  ASSERT_EQ(report.thermal, 2);
  EXPECT_NEAR(cv::mean(kelvin_of(report, 1))[0], 296, 1);
}

/// GDAL writes the unit for each page.
TEST_F(OtherCameras, AUnitAloneDoesNotUndoTheFirstPagesScale) {
  const auto import_with = [&](const std::string& unit_of_second) {
    made::TiffWords words;
    words.description = R"({"scale":0.04,"offset":0})";
    words.gdal_metadata = "<GDALMetadata>\n  <Item name=\"UNITTYPE\" role=\"unittype\">" +
                          unit_of_second + "</Item>\n</GDALMetadata>\n";
    std::string bytes = made::tiff_of_pages(
        {noise(CV_16UC1, 7300, 7500, 1), noise(CV_16UC1, 7300, 7500, 2)}, words);
    const std::size_t size = words.description.size();
    bytes.replace(bytes.rfind(words.description), size, std::string(size, ' '));
    put("t/rec.tif", bytes);
    return imported();
  };
  const ImportReport kelvin = import_with("K");
  ASSERT_EQ(kelvin.thermal, 2);
  EXPECT_NEAR(cv::mean(kelvin_of(kelvin, 1))[0], 296, 1);
  const ImportReport other = import_with("degF");
  EXPECT_EQ(other.thermal, 1);
  EXPECT_THAT(other.warnings, test::one_says("left out", "rec.tif (image 2): ", "\"unit\""));
}

TEST_F(OtherCameras, MoreRecordsThanAnImageHasAreDamage) {
  const std::string file =
      made::flir_file(cv::Mat(120, 160, CV_16UC1, cv::Scalar(made::flir_signal(300, camera))),
                      camera, made::FlirPixels::raw, {});
  const auto announcing = [&](int records) {
    std::string bytes = file;
    bytes[0x1e] = static_cast<char>(records >> 8);
    bytes[0x1f] = static_cast<char>(records & 0xff);
    return bytes;
  };
  EXPECT_TRUE(read_flir_file(announcing(256), "r.fff"));
  const auto refused = read_flir_file(announcing(257), "r.fff");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message(), test::says("r.fff", "257 FLIR records"));
}

TEST_F(OtherCameras, ADronesThermalImageIsNoPhoto) {
  put("in/1.jpg", made::dji_jpeg(cv::Mat(120, 160, CV_16UC1, cv::Scalar(9000))));
  put_photo("in/2.jpg", 1);
  const ImportReport report = imported_photos();
  EXPECT_EQ(report.visible, 1);
  EXPECT_THAT(report.warnings, test::one_says("left out", "1.jpg", "a thermal image, not a photo"));
}

/// As a B60 writes it: luma and colour differences in the places of red, green and blue. A picture
/// that has these themselves there stays as it is.
TEST_F(OtherCameras, AFlirCamerasPngHasItsColours) {
  options.embedded_visible = true;
  const auto imported_of = [&](const cv::Mat& stored) -> cv::Mat {
    put("t/a.jpg",
        made::flir_jpeg(counts(1) / 2, camera, made::FlirPixels::raw, *encode_png(stored)));
    const ImportReport report = imported();
    const auto frames = report.session.frames_of(Modality::visible);
    EXPECT_EQ(frames.size(), 1u);
    if (frames.size() != 1) return cv::Mat(60, 80, CV_8UC3, cv::Scalar::all(0));
    const auto image = read_visible(report.session.path_of(*frames[0]));
    EXPECT_TRUE(image) << image.error().message();
    return image ? *image : cv::Mat(60, 80, CV_8UC3, cv::Scalar::all(0));
  };
  cv::Mat color(60, 80, CV_8UC3, cv::Scalar(110, 120, 130));
  color(cv::Rect(0, 0, 40, 30)).setTo(cv::Scalar(30, 60, 200));
  cv::Mat luma, as_stored(color.size(), CV_8UC3);
  cv::cvtColor(color, luma, cv::COLOR_BGR2YCrCb);
  const int from_to[] = {0, 2, 1, 0, 2, 1};  // Y to red, Cr to blue, Cb to green
  cv::mixChannels(&luma, 1, &as_stored, 1, from_to, 3);
  EXPECT_LE(cv::norm(imported_of(as_stored), color, cv::NORM_INF), 4);
  const cv::Mat red(60, 80, CV_8UC3, cv::Scalar(30, 60, 200));
  EXPECT_EQ(cv::norm(imported_of(red), red, cv::NORM_INF), 0);
}

TEST_F(OtherCameras, EveryPageOfAnEightBitTiffIsAFrame) {
  const cv::Mat second = noise(CV_8UC1, 0, 255, 2);
  put("t/rec.tif", made::tiff_of_pages({noise(CV_8UC1, 0, 255, 1), second}));
  const ImportReport report = imported();
  ASSERT_EQ(report.thermal, 2);
  const auto stored = read_image(report.session.path_of(report.session.frames[1]));
  ASSERT_TRUE(stored) << stored.error().message();
  EXPECT_EQ(cv::norm(*stored, second, cv::NORM_INF), 0);
}

TEST_F(OtherCameras, HiddenFilesAreLeftOutByName) {
  put_photo("in/1.jpg", 1);
  put_photo("in/.trashed-1700000000-2.jpg", 2);
  put("in/._1.jpg", "of a Mac");
  const ImportReport report = imported_photos();
  EXPECT_EQ(report.visible, 1);
  EXPECT_THAT(report.warnings, test::one_says("left out", ".trashed-1700000000-2.jpg", "hidden"));
  EXPECT_THAT(report.warnings, test::none_says("._1.jpg"));
}

TEST_F(OtherCameras, FocalLengthsThatNoLensHasAreNotBelieved) {
  const auto focal_px_of = [&](int focal_35mm) {
    const std::string number{static_cast<char>(focal_35mm), static_cast<char>(focal_35mm >> 8)};
    put("in/1.jpg",
        with_exif_block(photo(1), replaced(made::exif_block(1), "\x05\xa4\x03\0\x01\0\0\0\x1a\0"s,
                                           "\x05\xa4\x03\0\x01\0\0\0"s + number)));
    return imported_photos().session.devices.at(0).lens.focal_px;
  };
  EXPECT_TRUE(focal_px_of(26));
  EXPECT_TRUE(focal_px_of(600));
  EXPECT_FALSE(focal_px_of(4));
  EXPECT_FALSE(focal_px_of(4000));
}

TEST_F(OtherCameras, AThermalCamerasClockIsThatOfItsPhotos) {
  put("in/1.jpg", with_exif_block(photo(1), made::exif_block(1)));  // local time
  put("t/1.jpg", flir_taken_at(exif_time_s - 7200, -120));          // UTC, two hours less
  options.visible = {folder / "in"};
  const ImportReport report = imported();
  ASSERT_EQ(report.session.frames.size(), 2u);
  EXPECT_EQ(report.session.frames[0].host_time_ns, exif_time_s * one_s);
  EXPECT_EQ(report.session.frames[1].host_time_ns, exif_time_s * one_s);
  options.visible.clear();
  EXPECT_EQ(imported().session.frames.at(0).host_time_ns, (exif_time_s - 7200) * one_s);
}

TEST_F(OtherCameras, AFlirFileWithoutATimeHasThatOfItsExif) {
  put("t/1.jpg", with_exif_block(flir_taken_at(0, 0), made::exif_block(1)));
  EXPECT_EQ(imported().session.frames.at(0).host_time_ns, exif_time_s * one_s);
}

}  // namespace
}  // namespace orbitfuse
