// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/watch_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "capture/recording/recorder.hpp"
#include "core/image/image_codec.hpp"
#include "core/system/file_io.hpp"
#include "tests/support/made_files.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string photo(int seed, int width = 40, int height = 30) {
  cv::Mat image(height, width, CV_8UC3);
  cv::RNG random(static_cast<std::uint64_t>(seed + 1));
  random.fill(image, cv::RNG::UNIFORM, 0, 255);
  return *encode_jpeg(image, 90);
}

class WatchTest : public ::testing::Test {
 protected:
  WatchTest() {
    options.folder = folder.path();
    options.settle = 60ms;
    options.rescan = 20ms;
    options.give_up = 300ms;
  }

  void put(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder / name, std::ios::binary) << bytes;
  }

  /// The next frame, rejection or event.
  static Delivery soon(FrameSource& source) {
    const auto deadline = std::chrono::steady_clock::now() + 10s;
    while (std::chrono::steady_clock::now() < deadline) {
      auto delivery = source.next(50ms);
      EXPECT_TRUE(delivery);
      if (delivery && delivery->kind != Delivery::Kind::timeout) return std::move(*delivery);
    }
    ADD_FAILURE() << "nothing came";
    return {};
  }
  static bool quiet(FrameSource& source, std::chrono::milliseconds time = 250ms) {
    return source.next(time)->kind == Delivery::Kind::timeout;
  }

  test::TempFolder folder;
  WatchOptions options;
};

TEST_F(WatchTest, NewPhotosComeByteForByteAndOldOnesStay) {
  put("old.jpg", photo(0));
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  EXPECT_TRUE(quiet(source));
  put("IMG_1.jpg", photo(1));
  const Delivery first = soon(source);
  ASSERT_EQ(first.kind, Delivery::Kind::frame) << first.reason;
  EXPECT_EQ(first.frame.encoded, photo(1));
  EXPECT_EQ(first.frame.id, 0u);
  EXPECT_GT(first.frame.host_time_ns, 0);
  EXPECT_EQ(first.frame.flags, (std::vector<std::string>{"file-time", "still"}));  // no EXIF
  EXPECT_THAT(first.frame.source, HasSubstr("IMG_1.jpg"));
  put("IMG_2.jpg", photo(2));
  EXPECT_EQ(soon(source).frame.id, 1u);
}

TEST_F(WatchTest, TransparentPixelsAreTold) {
  cv::Mat image(30, 40, CV_8UC4);
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0, 255);
  cv::Mat alpha(image.size(), CV_8UC1, cv::Scalar(255));
  const auto png = [&] {
    cv::mixChannels(alpha, image, {0, 3});
    image.at<cv::Vec4b>(0, 0)[0] ^= 1;  // another photo
    return *encode_png(image);
  };
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  put("1.png", png());
  EXPECT_EQ(soon(source).kind, Delivery::Kind::frame);
  EXPECT_TRUE(quiet(source)) << "wholly opaque";
  alpha(cv::Rect(0, 0, 20, 30)).setTo(0);
  put("2.png", png());
  const Delivery photo = soon(source), told = soon(source);
  ASSERT_EQ(photo.kind, Delivery::Kind::frame) << photo.reason;
  EXPECT_THAT(photo.frame.flags, ::testing::Contains("transparent"));
  EXPECT_EQ(told.reason, "transparent");
  EXPECT_THAT(told.detail, HasSubstr("2.png: 50 % of its pixels"));
  put("3.png", png());
  const Delivery next = soon(source);
  EXPECT_THAT(next.frame.flags, ::testing::Contains("transparent"));
  EXPECT_TRUE(quiet(source)) << "the flag tells of the others";
}

/// A preview, or another camera's image: which one a frame is to be made of is the user's word.
TEST_F(WatchTest, PagesOfAnotherSizeAreTold) {
  options.modality = Modality::thermal;
  const auto counts = [](int width) {
    cv::Mat image(30, width, CV_16UC1);
    cv::RNG(static_cast<std::uint64_t>(width)).fill(image, cv::RNG::UNIFORM, 29300, 29700);
    return image;
  };
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  put("1.tiff", made::tiff_of_pages({counts(40), counts(20)}, R"({"scale":0.01})"));
  const Delivery photo = soon(source), told = soon(source);
  ASSERT_EQ(photo.kind, Delivery::Kind::frame) << photo.reason;
  EXPECT_EQ(photo.frame.pixels.cols, 40);
  EXPECT_EQ(told.reason, "ignored");
  EXPECT_THAT(told.detail, HasSubstr("1.tiff: page 2 (20x30, 16-bit)"));
  EXPECT_TRUE(told.kept) << "no file was passed over";
  // A camera's program writes them all alike: once is enough.
  put("2.tiff", made::tiff_of_pages({counts(40) + 1, counts(20)}, R"({"scale":0.01})"));
  const Delivery second = soon(source);
  ASSERT_EQ(second.kind, Delivery::Kind::frame) << second.reason;
  put("3.tiff", made::tiff_of_pages({counts(40) + 2, counts(20)}, R"({"scale":0.01})"));
  EXPECT_EQ(soon(source).kind, Delivery::Kind::frame);
}

TEST_F(WatchTest, TwoScalesOfOneFileAreTold) {
  options.modality = Modality::thermal;
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  put("1.tiff.json", R"({"scale":0.02,"offset":150})");
  put("1.tiff", *encode_tiff(cv::Mat1w(30, 40, 29500), R"({"scale":0.01})"));
  const Delivery photo = soon(source), told = soon(source);
  ASSERT_EQ(photo.kind, Delivery::Kind::frame) << photo.reason;
  EXPECT_EQ(told.reason, "scale");
  EXPECT_THAT(told.detail, HasSubstr("1.tiff.json 0.02 K"));
}

TEST_F(WatchTest, WhatIsToldOfTheLastFileIsNotLostWhenTheRecordingEnds) {
  options.modality = Modality::thermal;
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  const cv::Mat1w large(30, 40, 29500), small(30, 20, 29500);
  put("1.tiff", made::tiff_of_pages({large, small}, R"({"scale":0.01})"));
  ASSERT_EQ(soon(source).kind, Delivery::Kind::frame);
  const std::vector<Delivery> rest = source.unfinished();
  ASSERT_EQ(rest.size(), 1u);
  EXPECT_THAT(rest[0].detail, HasSubstr("1.tiff: page 2"));
  EXPECT_TRUE(source.unfinished().empty());
}

TEST_F(WatchTest, HotThermalPhotosTakeACoarserScaleForGoodAndTellDeadPixels) {
  options.modality = Modality::thermal;
  const FlirCalibration camera = made::flir_calibration();
  const auto shot = [&](double spot_k, int number) {
    cv::Mat signal(30, 40, CV_16UC1, cv::Scalar(made::flir_signal(300, camera)));
    signal.at<std::uint16_t>(5, 6) = made::flir_signal(spot_k, camera);
    signal.at<std::uint16_t>(0, 0) =
        static_cast<std::uint16_t>(signal.at<std::uint16_t>(0, 0) + number);
    return made::flir_jpeg(signal, camera);
  };
  const auto scale_of = [&](FrameSource& source, const std::string& name, double spot_k,
                            int number) {
    put(name, shot(spot_k, number));
    const Delivery delivery = soon(source);
    EXPECT_EQ(delivery.kind, Delivery::Kind::frame) << delivery.reason << delivery.detail;
    const Frame& frame = delivery.frame;
    if (frame.pixels.empty()) return 0.0;
    EXPECT_NEAR(frame.pixels.at<std::uint16_t>(5, 6) * frame.kelvin_per_count, spot_k, 0.1);
    return frame.kelvin_per_count;
  };
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  EXPECT_EQ(scale_of(source, "1.jpg", 320, 1), 0.01);
  EXPECT_EQ(scale_of(source, "2.jpg", 700, 2), 0.02);
  EXPECT_EQ(scale_of(source, "3.jpg", 320, 3), 0.02);
  source.stop();
  WatchSource resumed(options);
  ASSERT_TRUE(resumed.start());
  resumed.store_no_finer_than(0.02);
  EXPECT_EQ(scale_of(resumed, "4.jpg", 320, 4), 0.02);
  // Below its offset the signal stands for no temperature.
  cv::Mat signal(30, 40, CV_16UC1, cv::Scalar(made::flir_signal(300, camera)));
  signal(cv::Rect(0, 0, 3, 2)).setTo(1);
  put("5.jpg", made::flir_jpeg(signal, camera));
  const Delivery holed = soon(resumed), told = soon(resumed);
  ASSERT_EQ(holed.kind, Delivery::Kind::frame) << holed.reason;
  EXPECT_THAT(holed.frame.flags, ::testing::Contains("clipped"));
  EXPECT_EQ(told.reason, "clipped");
  EXPECT_THAT(told.detail, HasSubstr("5.jpg: 6 samples"));
}

TEST_F(WatchTest, ResumedSessionGetsNoPhotoTwice) {
  options.existing = true;
  for (int i : {1, 2}) put("IMG_" + std::to_string(i) + ".jpg", photo(i));
  std::vector<FrameRecord> recorded;
  {
    WatchSource source(options);
    ASSERT_TRUE(source.start());
    for (int i = 0; i < 2; ++i) {
      const Delivery delivery = soon(source);
      FrameRecord record;
      // The first as it is stored, byte for byte; the second as a thermal one, stored decoded.
      if (i == 0) record.content_hash = content_hash(delivery.frame.encoded);
      record.source = delivery.frame.source;
      record.host_time_ns = delivery.frame.host_time_ns;
      recorded.push_back(record);
    }
  }
  put("IMG_3.jpg", photo(3));
  put("IMG_2.jpg.copy.jpg", photo(1));
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  DeviceInfo known;
  known.id = "visible0";
  source.resume({known, recorded, {}, 3});
  int frames = 0, duplicates = 0;
  for (int i = 0; i < 4; ++i) {
    const Delivery delivery = soon(source);
    frames += delivery.kind == Delivery::Kind::frame;
    duplicates += delivery.reason == "duplicate";
    if (delivery.kind == Delivery::Kind::frame) {
      EXPECT_EQ(delivery.frame.encoded, photo(3));
    }
  }
  EXPECT_EQ(frames, 1);
  EXPECT_EQ(duplicates, 3);
}

TEST_F(WatchTest, ResumedSessionTakesNoOtherCamera) {
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  DeviceInfo known;
  known.model = "Phone 9";
  source.resume({known, {}, {}, 0});
  EXPECT_EQ(source.describe().model, "Phone 9");
  EXPECT_EQ(source.describe().id, options.device_id);
  put("IMG_1.jpg", photo(1));  // says of no camera at all
  const Delivery delivery = soon(source);
  EXPECT_EQ(delivery.kind, Delivery::Kind::rejected);
  EXPECT_THAT(delivery.reason, HasSubstr("Phone 9"));
}

TEST_F(WatchTest, WhatWasRejectedIsNotCountedAgain) {
  const std::string cut = photo(1).substr(0, 400);
  put("IMG_1.jpg", cut);
  options.existing = true;
  std::string reason;
  {
    WatchSource source(options);
    ASSERT_TRUE(source.start());
    const Delivery delivery = soon(source);
    ASSERT_EQ(delivery.kind, Delivery::Kind::rejected);
    EXPECT_THAT(delivery.reason, HasSubstr("IMG_1.jpg"));
    reason = delivery.reason;
  }
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  source.resume({source.describe(), {}, {{"visible0", 0, 1, rejected_because + reason}}, 1});
  const Delivery again = soon(source);
  EXPECT_EQ(again.reason, "ignored");
  EXPECT_THAT(again.detail, HasSubstr("as before"));
  put("IMG_1.jpg", cut);  // since then, from a card that counts from 1 again
  fs::last_write_time(folder / "IMG_1.jpg", fs::file_time_type::clock::now() + 2s);
  EXPECT_EQ(soon(source).kind, Delivery::Kind::rejected);
  put("IMG_1.jpg", photo(1));  // copied anew, whole
  EXPECT_EQ(soon(source).kind, Delivery::Kind::frame);
}

TEST_F(WatchTest, AnotherSizeStaysRejectedInAResumedSession) {
  put("IMG_1.jpg", photo(1));
  put("IMG_2.jpg", photo(2, 60, 45));
  options.existing = true;
  std::vector<FrameRecord> recorded(1);
  {
    WatchSource source(options);
    ASSERT_TRUE(source.start());
    const Delivery first = soon(source);
    ASSERT_EQ(first.kind, Delivery::Kind::frame);
    recorded[0].content_hash = content_hash(first.frame.encoded);
    EXPECT_EQ(soon(source).kind, Delivery::Kind::rejected);
  }
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  source.resume({source.describe(), recorded, {}, 2});
  EXPECT_EQ(soon(source).reason, "duplicate");
  EXPECT_EQ(soon(source).kind, Delivery::Kind::rejected) << "not the first of another camera";
}

TEST_F(WatchTest, APhotoAmongThermalImagesIsPassedOver) {
  options.modality = Modality::thermal;
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  cv::Mat counts(30, 40, CV_16UC1);
  cv::RNG(5).fill(counts, cv::RNG::UNIFORM, 29300, 29700);
  put("IMG_0.tiff", made::tiff_of_pages({counts}, R"({"scale":0.01})"));
  EXPECT_EQ(soon(source).kind, Delivery::Kind::frame);
  put("IMG_1.jpg", photo(1));
  const Delivery delivery = soon(source);
  EXPECT_EQ(delivery.reason, "ignored") << delivery.reason;
  EXPECT_THAT(delivery.detail, HasSubstr("IMG_1.jpg: 8-bit without temperatures"));
  put("IMG_2.jpg", photo(2).substr(0, 400));
  EXPECT_EQ(soon(source).kind, Delivery::Kind::rejected) << "cut off: nobody knows what it was";
}

TEST_F(WatchTest, ExistingPhotosComeInNaturalOrder) {
  for (int i : {10, 9, 1}) put("IMG_" + std::to_string(i) + ".jpg", photo(i));
  options.existing = true;
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  for (int i : {1, 9, 10}) EXPECT_EQ(soon(source).frame.encoded, photo(i)) << i;
}

TEST_F(WatchTest, FileWrittenInPiecesIsReadOnceAndWhole) {
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  const std::string bytes = photo(3);
  std::ofstream out(folder / "slow.jpg", std::ios::binary);
  out << bytes.substr(0, bytes.size() / 2) << std::flush;
  EXPECT_TRUE(quiet(source, 150ms));  // longer than the settling time: still not decodable
  out << bytes.substr(bytes.size() / 2) << std::flush;
  out.close();
  EXPECT_EQ(soon(source).frame.encoded, bytes);
  EXPECT_TRUE(quiet(source));
}

TEST_F(WatchTest, FileThatStaysCutIsRejectedAndCounted) {
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  put("cut.jpg", photo(4).substr(0, 400));
  const Delivery cut = soon(source);
  EXPECT_EQ(cut.kind, Delivery::Kind::rejected);
  EXPECT_THAT(cut.reason, HasSubstr("cut.jpg"));
  put("good.jpg", photo(5));
  EXPECT_EQ(soon(source).frame.id, cut.frame.id + 1);
}

TEST_F(WatchTest, DuplicatesOtherFormatsAndTemporaryFilesAreNotFrames) {
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  put("a.jpg", photo(6));
  EXPECT_EQ(soon(source).kind, Delivery::Kind::frame);
  put("copy of a.jpg", photo(6));
  EXPECT_EQ(soon(source).reason, "duplicate");
  put("b.webp", "RIFF");
  EXPECT_EQ(soon(source).reason, "ignored");
  put("c.jpg.part", photo(7).substr(0, 100));
  put(".c.jpg.swp", "x");
  EXPECT_TRUE(quiet(source));
  put("c.jpg.part", photo(7));
  fs::rename(folder / "c.jpg.part", folder / "c.jpg");
  EXPECT_EQ(soon(source).frame.encoded, photo(7));
}

TEST_F(WatchTest, OverwrittenFileIsANewPhoto) {
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  put("latest.jpg", photo(8));
  EXPECT_EQ(soon(source).frame.encoded, photo(8));
  put("latest.jpg", photo(9, 40, 30));
  EXPECT_EQ(soon(source).frame.encoded, photo(9));
}

TEST_F(WatchTest, AnotherCameraIsRejectedAndNamed) {
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  put("a.jpg", photo(10));
  EXPECT_EQ(soon(source).kind, Delivery::Kind::frame);
  put("b.jpg", photo(11, 60, 30));
  const Delivery other = soon(source);
  EXPECT_EQ(other.kind, Delivery::Kind::rejected);
  EXPECT_THAT(other.reason, HasSubstr("another camera"));
}

TEST_F(WatchTest, FolderThatGoesAndComesBack) {
  options.folder = folder / "card";
  fs::create_directory(options.folder);
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  fs::remove_all(options.folder);
  EXPECT_EQ(soon(source).reason, "disconnected");
  fs::create_directory(options.folder);
  EXPECT_EQ(soon(source).reason, "reconnected");
  put("card/a.jpg", photo(12));
  EXPECT_EQ(soon(source).kind, Delivery::Kind::frame);
}

TEST_F(WatchTest, ThermalTakesRadiometricFilesOnly) {
  options.modality = Modality::thermal;
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  put("photo.jpg", photo(13));
  EXPECT_EQ(soon(source).reason, "ignored");
  const cv::Mat kelvin(30, 40, CV_16UC1, cv::Scalar(29815));
  put("t.tiff", *encode_thermal_tiff(kelvin));
  const Delivery thermal = soon(source);
  ASSERT_EQ(thermal.kind, Delivery::Kind::frame) << thermal.reason;
  EXPECT_EQ(thermal.frame.pixels.at<std::uint16_t>(3, 3), 29815);
}

TEST_F(WatchTest, RadiometricJpegFromACameraBringsItsModel) {
  const fs::path files = testing::shared_data() / "rjpeg";
  fs::path sample;
  std::error_code none;
  for (fs::recursive_directory_iterator entry(files, none), end; !none && entry != end;
       entry.increment(none)) {
    if (sample.empty() && entry->path().extension() == ".jpg") sample = entry->path();
  }
  if (sample.empty()) GTEST_SKIP() << "the shared radiometric JPEGs are not here";
  options.modality = Modality::thermal;
  WatchSource source(options);
  ASSERT_TRUE(source.start());
  fs::copy_file(sample, folder / "FLIR0001.jpg");
  const Delivery delivery = soon(source);
  ASSERT_EQ(delivery.kind, Delivery::Kind::frame) << delivery.reason << delivery.detail;
  EXPECT_FALSE(delivery.frame.thermal_is_gray);
  EXPECT_EQ(delivery.frame.pixels.type(), CV_16UC1);
  EXPECT_NE(source.describe().model, "");
  // The visible source passes it over.
  WatchOptions visible = options;
  visible.modality = Modality::visible;
  visible.existing = true;
  WatchSource photos(visible);
  ASSERT_TRUE(photos.start());
  EXPECT_EQ(soon(photos).reason, "ignored");
}

TEST_F(WatchTest, AllOfACardJoinsTheSession) {
  for (int i = 0; i < 40; ++i) put("IMG_" + std::to_string(i) + ".jpg", photo(100 + i));
  options.existing = true;
  WatchSource source(options);
  const test::TempFolder out;
  const auto writer = SessionWriter::create(out / "s");
  ASSERT_TRUE(writer);
  RecorderOptions recorder_options;
  recorder_options.queue_frames = 1;  // a card is faster than a disk: nothing may be dropped
  Recorder recorder(**writer, recorder_options);
  std::atomic<bool> stop{false};
  std::atomic<int> stored{0};
  recorder.on_frame = [&](const StoredFrame&) { stop = ++stored == 40; };
  Progress progress;
  progress.cancel = &stop;
  (void)recorder.run({&source}, progress);
  ASSERT_TRUE((*writer)->close());
  const auto session = open_session(out / "s");
  ASSERT_TRUE(session);
  EXPECT_EQ(session->frames.size(), 40u);
  EXPECT_EQ(session->streams.at(0).lost, 0u);
}

TEST_F(WatchTest, MissingFolderHasARemedy) {
  options.folder = folder / "none";
  WatchSource source(options);
  EXPECT_EQ(source.start().error().kind, ErrorKind::input);
  options.folder.clear();
  EXPECT_EQ(WatchSource(options).start().error().kind, ErrorKind::usage);
}

}  // namespace
}  // namespace orbitfuse
