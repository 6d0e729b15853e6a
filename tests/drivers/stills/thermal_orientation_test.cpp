// SPDX-License-Identifier: BSD-3-Clause
// How a handheld thermal camera was held: its images come upright, as photos do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <tuple>

#include "capture/recording/session_writer.hpp"
#include "core/image/exif.hpp"
#include "core/session/session.hpp"
#include "drivers/stills/thermal_file.hpp"
#include "drivers/stills/watch_source.hpp"
#include "tests/drivers/stills/import_files.hpp"
#include "tests/support/made_files.hpp"
#include "tests/support/says.hpp"

namespace orbitfuse {
namespace {

class ThermalOrientation : public ImportFiles {
 protected:
  /// Warm at the stored image's top left, and wider than high.
  static cv::Mat counts(std::uint64_t seed) {
    cv::Mat image(30, 40, CV_16UC1);
    cv::RNG(seed).fill(image, cv::RNG::UNIFORM, 29000, 29010);
    image(cv::Rect(0, 0, 10, 10)) += 2000;
    return image;
  }
  static std::string with_exif(const std::string& jpeg, int orientation) {
    const std::string block = std::string("Exif\0\0", 6) + made::exif_block(orientation);
    std::string out = jpeg.substr(0, 2) + "\xff\xe1";
    out += static_cast<char>((block.size() + 2) >> 8);
    out += static_cast<char>((block.size() + 2) & 0xff);
    return out + block + jpeg.substr(2);
  }
  void put_flir(const std::string& name, int orientation, std::uint64_t seed,
                const std::string& photo = {}) const {
    const FlirCalibration camera = made::flir_calibration();
    cv::Mat signal(30, 40, CV_16UC1);
    cv::RNG(seed).fill(signal, cv::RNG::UNIFORM, made::flir_signal(290, camera),
                       made::flir_signal(290.1, camera));
    signal(cv::Rect(0, 0, 10, 10)).setTo(made::flir_signal(310, camera));
    put(name,
        with_exif(made::flir_jpeg(signal, camera, made::FlirPixels::raw, photo), orientation));
  }
  /// Of one radiometric JPEG of orientation 6, with its photo.
  Result<ImportReport> import_held_on_its_side(const cv::Mat& photo) {
    put_flir("t/a.jpg", 6, 1, *encode_jpeg(photo, 95));
    options.thermal = {folder / "t"};
    options.embedded_visible = true;
    return import();
  }
  static cv::Point2d warm_place(const cv::Mat& kelvin) {
    cv::Mat warm = kelvin > 300;
    const cv::Moments m = cv::moments(warm, true);
    return {m.m10 / m.m00, m.m01 / m.m00};
  }
};

TEST_F(ThermalOrientation, RadiometricJpegsComeUpright) {
  const struct {
    int orientation;
    cv::Size size;
    bool right, below;
  } cases[] = {{1, {40, 30}, false, false},
               {3, {40, 30}, true, true},
               {6, {30, 40}, true, false},
               {8, {30, 40}, false, true}};
  for (const auto& c : cases) {
    put_flir("t/a.jpg", c.orientation, 1);
    options.thermal = {folder / "t"};
    const auto report = import();
    ASSERT_TRUE(report) << report.error().message();
    const cv::Mat kelvin = kelvin_of(*report, 0);
    ASSERT_EQ(kelvin.size(), c.size) << c.orientation;
    const cv::Point2d warm = warm_place(kelvin);
    EXPECT_EQ(warm.x > c.size.width / 2.0, c.right) << c.orientation;
    EXPECT_EQ(warm.y > c.size.height / 2.0, c.below) << c.orientation;
    // 25 degrees are those of the sensor's long side.
    EXPECT_NEAR(*report->session.devices.at(0).lens.focal_px, Camera::from_fov(40, 30, 25).fx,
                1e-6);
    if (c.orientation == 1)
      EXPECT_THAT(report->warnings, test::none_says("EXIF"));
    else
      EXPECT_THAT(report->warnings, test::one_says("t/a.jpg: turned upright", "orientation"));
    std::filesystem::remove_all(folder / "session");
  }
}

/// The camera turned the picture and not what lies beside it: which way, no tag says.
TEST_F(ThermalOrientation, SamplesAcrossTheirPictureStayAndAreTold) {
  const FlirCalibration camera = made::flir_calibration();
  cv::Mat signal(30, 40, CV_16UC1, cv::Scalar(made::flir_signal(290, camera)));
  const cv::Mat upright(40, 30, CV_16UC1, cv::Scalar(made::flir_signal(290, camera)));
  const std::string tall = made::flir_jpeg(upright, camera),
                    broad = made::flir_jpeg(signal, camera);
  const auto end_of_records = [](const std::string& jpeg) { return jpeg.find("\xff\xe0", 1000); };
  ASSERT_NE(end_of_records(tall), tall.npos);
  put("t/a.jpg",
      with_exif(broad.substr(0, end_of_records(broad)) + tall.substr(end_of_records(tall)), 6));
  options.thermal = {folder / "t"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(kelvin_of(*report, 0).size(), cv::Size(40, 30));
  EXPECT_THAT(report->warnings, test::one_says("t/a.jpg", "lie across its picture"));
}

TEST_F(ThermalOrientation, TheEmbeddedPhotoIsTurnedWithIt) {
  cv::Mat photo(60, 80, CV_8UC3, cv::Scalar(40, 40, 40));
  photo(cv::Rect(0, 0, 20, 20)).setTo(cv::Scalar(250, 250, 250));
  const auto report = import_held_on_its_side(photo);
  ASSERT_TRUE(report) << report.error().message();
  const auto frames = report->session.frames_of(Modality::visible);
  ASSERT_EQ(frames.size(), 1u);
  const auto image = read_visible(report->session.path_of(*frames[0]));
  ASSERT_TRUE(image) << image.error().message();
  ASSERT_EQ(image->size(), cv::Size(60, 80));
  EXPECT_GT(image->at<cv::Vec3b>(10, 50)[0], 200);
  EXPECT_EQ(frames[0]->width, 60);
}

/// TIFF's own tag, and grey pictures, which are stored turned: whoever reads thermal frames takes
/// them as they are.
TEST_F(ThermalOrientation, TiffsAndGreyPicturesComeUpright) {
  made::TiffWords words;
  words.description = R"({"scale":0.01})";
  words.orientation = 8;
  put("t/a.tif", made::tiff_of_pages({counts(1)}, words));
  options.thermal = {folder / "t"};
  auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  const cv::Mat kelvin = kelvin_of(*report, 0);
  ASSERT_EQ(kelvin.size(), cv::Size(30, 40));
  EXPECT_GT(kelvin.at<float>(35, 5), 305);
  std::filesystem::remove_all(folder / "session");

  cv::Mat gray(30, 40, CV_8UC1, cv::Scalar(40));
  gray(cv::Rect(0, 0, 10, 10)).setTo(240);
  put("g/a.jpg", with_exif(*encode_jpeg(gray, 95), 6));
  options.thermal = {folder / "g"};
  report = import();
  ASSERT_TRUE(report) << report.error().message();
  const FrameRecord& frame = report->session.frames.at(0);
  EXPECT_EQ(frame.width, 30);
  const auto stored = read_image(report->session.path_of(frame));
  ASSERT_TRUE(stored) << stored.error().message();
  ASSERT_EQ(stored->size(), cv::Size(30, 40));
  cv::Mat first;
  cv::extractChannel(*stored, first, 0);
  EXPECT_GT(first.at<std::uint8_t>(5, 25), 200);
}

/// The tag of the page that is read counts, not that of a preview in front of it.
TEST_F(ThermalOrientation, APreviewInFrontDoesNotSayHowTheImageIsHeld) {
  const cv::Mat preview(3, 4, CV_8UC1, cv::Scalar(1));
  made::TiffWords words;
  words.description = R"({"scale":0.01})";
  words.subfile_of_first = 1;
  for (const auto& [of_preview, of_image, size] :
       {std::tuple(1, 6, cv::Size(30, 40)), std::tuple(6, 1, cv::Size(40, 30))}) {
    words.orientation_of_first = of_preview;
    words.orientation = of_image;
    const std::string bytes = made::tiff_of_pages({preview, counts(1)}, words);
    put("t/a.tif", bytes);
    const auto file = read_thermal_file(folder / "t/a.tif");
    ASSERT_TRUE(file) << file.error().message();
    EXPECT_EQ(file->image.size(), size);
    EXPECT_EQ(file->orientation, of_image);
    EXPECT_EQ(read_exif(bytes).orientation, of_image);
  }
}

/// Cameras turn their photo and not what lies beside it.
TEST_F(ThermalOrientation, AnEmbeddedPhotoThatStandsUprightAlreadyIsNotTurned) {
  const cv::Mat photo(80, 60, CV_8UC3, cv::Scalar(40, 90, 40));
  const auto report = import_held_on_its_side(photo);
  ASSERT_TRUE(report) << report.error().message();
  const auto frames = report->session.frames_of(Modality::visible);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(cv::Size(frames[0]->width, frames[0]->height), cv::Size(60, 80));
  EXPECT_EQ(kelvin_of(*report, 0).size(), cv::Size(30, 40));
  EXPECT_THAT(report->warnings, test::one_says("t/a.jpg", "its photo lies across"));
}

/// Held both ways it is one camera: its focal length is true of both, and each size is posed alone.
TEST_F(ThermalOrientation, OneCameraHeldBothWaysMayHaveOneFocalLength) {
  put_flir("t/a.jpg", 1, 1);
  put_flir("t/b.jpg", 6, 2);
  options.thermal = {folder / "t"};
  options.thermal_focal_px = 70;
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->thermal, 2);
  ASSERT_EQ(report->session.devices.size(), 2u);
  for (const DeviceInfo& device : report->session.devices) EXPECT_EQ(device.lens.focal_px, 70);
}

/// In a watched folder it is one device; its frames are recorded upright, and posed by size.
TEST_F(ThermalOrientation, AWatchedCameraMayBeHeldBothWays) {
  WatchOptions watched;
  watched.folder = folder / "t";
  watched.modality = Modality::thermal;
  watched.settle = watched.rescan = std::chrono::milliseconds(20);
  std::filesystem::create_directories(watched.folder);
  WatchSource source(watched);
  ASSERT_TRUE(source.start());
  const auto soon = [&] {
    auto delivery = source.next(std::chrono::seconds(10));
    EXPECT_TRUE(delivery);
    return delivery ? std::move(*delivery) : Delivery{};
  };
  put_flir("t/a.jpg", 1, 1);
  const Delivery broad = soon();
  ASSERT_EQ(broad.kind, Delivery::Kind::frame) << broad.reason;
  put_flir("t/b.jpg", 6, 2);
  const Delivery upright = soon(), told = soon();
  ASSERT_EQ(upright.kind, Delivery::Kind::frame) << upright.reason;
  EXPECT_EQ(told.event, EventKind::held);
  EXPECT_THAT(told.detail, ::testing::HasSubstr("b.jpg: turned upright"));
  put_flir("t/c.jpg", 6, 3);
  EXPECT_EQ(soon().kind, Delivery::Kind::frame);
  EXPECT_EQ(source.next(std::chrono::milliseconds(200))->kind, Delivery::Kind::timeout)
      << "told once";

  const auto writer = SessionWriter::create(folder / "session", {});
  ASSERT_TRUE(writer) << writer.error().message();
  const DeviceInfo device = source.describe();
  ASSERT_TRUE((*writer)->add_device(device));
  for (const Delivery* one : {&broad, &upright})
    ASSERT_TRUE((*writer)->append(device.id, one->frame));
  ASSERT_TRUE((*writer)->close());
  const auto session = open_session(folder / "session");
  ASSERT_TRUE(session) << session.error().message();
  ASSERT_EQ(session->frames.size(), 2u);
  EXPECT_EQ(session->frames[0].width, 40);
  EXPECT_EQ(session->frames[1].width, 30);
}

/// Of many one sentence.
TEST_F(ThermalOrientation, AnOrbitInPortraitIsToldOnce) {
  for (int i = 0; i < 8; ++i)
    put_flir("t/" + std::to_string(i) + ".jpg", 6, static_cast<std::uint64_t>(i) + 1);
  options.thermal = {folder / "t"};
  const auto report = import();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->thermal, 8);
  EXPECT_THAT(report->warnings, test::one_says("8 files (t/0.jpg, ", "turned upright"));
  EXPECT_LT(report->warnings.size(), 4u);
}

}  // namespace
}  // namespace orbitfuse
