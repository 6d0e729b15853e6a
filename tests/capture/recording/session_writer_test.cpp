// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/session_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "capture/recording/raw_counts.hpp"
#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "tests/capture/scripted_source.hpp"
#include "tests/support/file_size_limit.hpp"
#include "tests/support/refused_locks.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using test::TempFolder;
using test::thermal_pixels;

DeviceInfo thermal_device() { return {"thermal0", Modality::thermal, "test", "M", "1", {}}; }
DeviceInfo visible_device() { return {"visible0", Modality::visible, "test", "M", "2", {}}; }

Frame thermal_frame(std::uint64_t id) { return test::frame_delivery(id, thermal_pixels()).frame; }

TEST(SessionWriter, ThermalAndVisibleComeBackBitExact) {
  const TempFolder folder;
  auto writer = SessionWriter::create(folder / "s", {{"operator", "A"}});
  ASSERT_TRUE(writer) << writer.error().message();
  ASSERT_TRUE((*writer)->add_device(thermal_device()));
  ASSERT_TRUE((*writer)->add_device(visible_device()));
  Frame thermal = thermal_frame(5);
  thermal.station = Station{1, 2, 60, 30, 5, 5};
  const auto t = (*writer)->append("thermal0", thermal);
  ASSERT_TRUE(t) << t.error().message();
  EXPECT_EQ(t->file, "thermal/000000.tiff");
  Frame visible;
  visible.id = 9;
  visible.encoded = *encode_jpeg(cv::Mat(40, 60, CV_8UC3, cv::Scalar(1, 2, 3)), 90);
  visible.extension = ".jpg";
  const auto v = (*writer)->append("visible0", visible);
  ASSERT_TRUE(v) << v.error().message();
  visible.encoded.clear();
  visible.pixels = cv::Mat(40, 60, CV_8UC3, cv::Scalar(9, 8, 7));
  visible.tracking = true;
  ASSERT_TRUE((*writer)->append("visible0", visible));
  ASSERT_TRUE((*writer)->close());

  const auto session = open_session(folder / "s");
  ASSERT_TRUE(session) << session.error().message();
  EXPECT_TRUE(session->complete);
  EXPECT_TRUE(session->warnings.empty());
  ASSERT_EQ(session->frames.size(), 3u);
  EXPECT_EQ(session->frames[0].station->index, 2);
  EXPECT_EQ(session->frames[0].sequence, 5u);
  EXPECT_EQ(session->frames[1].width, 60);
  EXPECT_EQ(session->frames[2].file, "visible/track_000000.png");
  EXPECT_EQ(cv::norm(*read_image(folder / "s/thermal/000000.tiff"), thermal_pixels(), cv::NORM_INF),
            0);
  EXPECT_NEAR(read_thermal_k(folder / "s/thermal/000000.tiff")->at<float>(0, 0), 290.0, 1e-3);
  EXPECT_EQ(content_hash(*read_file(folder / "s/visible/000000.jpg")),
            session->frames[1].content_hash);
  EXPECT_EQ(
      cv::norm(*read_visible(folder / "s/visible/track_000000.png"), visible.pixels, cv::NORM_INF),
      0);
}

TEST(SessionWriter, NeverIntoAFolderWithContent) {
  const TempFolder folder;
  test::put(folder / "s/precious.txt", "x");
  const auto writer = SessionWriter::create(folder / "s");
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().kind, ErrorKind::input);
  EXPECT_TRUE(std::filesystem::exists(folder / "s/precious.txt"));
}

TEST(SessionWriter, WrongFramesAreInputErrors) {
  const TempFolder folder;
  auto writer = *SessionWriter::create(folder / "s");
  ASSERT_TRUE(writer->add_device(thermal_device()));
  ASSERT_TRUE(writer->add_device(visible_device()));
  Frame frame;
  EXPECT_EQ(writer->append("thermal0", frame).error().kind, ErrorKind::input);
  frame.pixels = cv::Mat(4, 4, CV_8UC1, cv::Scalar(1));
  EXPECT_EQ(writer->append("thermal0", frame).error().kind, ErrorKind::input);
  frame.pixels = thermal_pixels();
  EXPECT_EQ(writer->append("visible0", frame).error().kind, ErrorKind::input);
  EXPECT_EQ(writer->append("unknown", frame).error().kind, ErrorKind::input);
  frame.encoded = "text, not a picture";
  frame.extension = ".jpg";
  EXPECT_EQ(writer->append("visible0", frame).error().kind, ErrorKind::input);
  frame.thermal_is_gray = true;
  frame.encoded.clear();
  frame.pixels = cv::Mat(4, 4, CV_8UC1, cv::Scalar(1));
  EXPECT_TRUE(writer->append("thermal0", frame));
  EXPECT_EQ(open_session(folder / "s")->frames.size(), 1u);
}

TEST(SessionWriter, TwoWritersCannotShareASession) {
  const TempFolder folder;
  auto first = SessionWriter::create(folder / "s");
  ASSERT_TRUE(first);
  const auto second = SessionWriter::resume(folder / "s");
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::device);
}

/// Some network disks: nobody else records, and nothing may stay that keeps the next try out.
TEST(SessionWriter, ADiskWithoutLocksIsNoOtherRecorder) {
  const TempFolder folder;
  {
    const test::NoLocks no_locks;
    const auto writer = SessionWriter::create(folder / "s");
    ASSERT_FALSE(writer);
    EXPECT_EQ(writer.error().kind, ErrorKind::device);
    EXPECT_EQ(writer.error().found, "cannot be locked: No locks available");
    EXPECT_FALSE(std::filesystem::exists(folder / "s"));
  }
  ASSERT_TRUE(SessionWriter::create(folder / "s"));
  const test::NoLocks no_locks;
  const auto resumed = SessionWriter::resume(folder / "s");
  ASSERT_FALSE(resumed);
  EXPECT_EQ(resumed.error().found, "cannot be locked: No locks available");
  EXPECT_TRUE(open_session(folder / "s")) << "what was there stays";
}

/// It is no session to go on with, and "holds a session already" would be a dead end.
TEST(SessionWriter, AManifestWithoutOneWholeLineIsNamed) {
  for (const char* text : {"", "{\"created\":\"2026-11-26T1"}) {
    const TempFolder folder;
    test::put(folder / "s/manifest.jsonl", text);
    std::filesystem::create_directories(folder / "s/visible");
    const auto writer = SessionWriter::create(folder / "s");
    ASSERT_FALSE(writer);
    EXPECT_THAT(writer.error().message(), ::testing::HasSubstr("killed as it began; delete its"));
    test::put(folder / "s/visible/000000.jpg", "a frame");
    EXPECT_EQ(SessionWriter::create(folder / "s").error().found, "holds a session already");
    EXPECT_THAT(open_session(folder / "s").error().message(),
                ::testing::AnyOf(::testing::HasSubstr("import the images beside it"),
                                 ::testing::HasSubstr("not a JSON object")));
  }
}

TEST(SessionWriter, ResumeAfterACrashContinuesAndOverwritesNothing) {
  const TempFolder folder;
  {
    auto writer = *SessionWriter::create(folder / "s");
    ASSERT_TRUE(writer->add_device(thermal_device()));
    ASSERT_TRUE(writer->append("thermal0", thermal_frame(0)));
  }
  // The crash: an image without its line, and half a line.
  test::put(folder / "s/thermal/000001.tiff", "orphan");
  test::put(folder / "s/manifest.jsonl",
            test::get(folder / "s/manifest.jsonl") + "{\"type\":\"fra");
  {
    auto writer = SessionWriter::resume(folder / "s");
    ASSERT_TRUE(writer) << writer.error().message();
    ASSERT_TRUE((*writer)->add_device(thermal_device()));
    DeviceInfo other = thermal_device();
    other.serial = "another";
    EXPECT_FALSE((*writer)->add_device(other));
    const auto record = (*writer)->append("thermal0", thermal_frame(7));
    ASSERT_TRUE(record);
    EXPECT_EQ(record->file, "thermal/000002.tiff");
    ASSERT_TRUE((*writer)->close());
  }
  EXPECT_EQ(test::get(folder / "s/thermal/000001.tiff"), "orphan");
  const auto session = open_session(folder / "s");
  ASSERT_TRUE(session) << session.error().message();
  EXPECT_TRUE(session->complete);
  EXPECT_EQ(session->frames.size(), 2u);
  EXPECT_EQ(session->devices.size(), 1u);
  ASSERT_EQ(session->events.size(), 1u);
  EXPECT_EQ(session->events[0].kind, "resumed");
}

/// An editor's blank lines would lie between lines then, where they are damage; and a line that
/// lacks only its end was read.
TEST(SessionWriter, ResumeBehindBlankLinesOrWithoutTheLastLinesEndLosesNothing) {
  for (const std::string behind : {"\n\n", "  \r\n", "no end", " "}) {
    const TempFolder folder;
    {
      auto writer = *SessionWriter::create(folder / "s");
      ASSERT_TRUE(writer->add_device(thermal_device()));
      ASSERT_TRUE(writer->append("thermal0", thermal_frame(0)));
    }
    std::string text = test::get(folder / "s/manifest.jsonl");
    if (behind == "no end")
      text.pop_back();
    else
      text += behind;
    test::put(folder / "s/manifest.jsonl", text);
    {
      auto writer = SessionWriter::resume(folder / "s");
      ASSERT_TRUE(writer) << writer.error().message();
      ASSERT_TRUE((*writer)->append("thermal0", thermal_frame(7)));
      ASSERT_TRUE((*writer)->close());
    }
    const auto session = open_session(folder / "s");
    ASSERT_TRUE(session) << '"' << behind << "\": " << session.error().message();
    EXPECT_TRUE(session->complete);
    EXPECT_EQ(session->frames.size(), 2u) << '"' << behind << '"';
  }
}

TEST(SessionWriter, FullDiskKeepsEveryAcknowledgedFrame) {
  const TempFolder folder;
  auto writer = *SessionWriter::create(folder / "s");
  ASSERT_TRUE(writer->add_device(thermal_device()));
  ASSERT_TRUE(writer->append("thermal0", thermal_frame(0)));
  // First too small for an image, then so small that the manifest line is cut.
  const rlim_t manifest_size = std::filesystem::file_size(folder / "s/manifest.jsonl");
  for (const rlim_t bytes : {rlim_t{200}, manifest_size + 40}) {
    const auto [gap, record] = [&] {
      const test::FileSizeLimit full(bytes);
      Status refused = writer->append(GapRecord{"thermal0", 1, 1, std::string(80, 'x')});
      return std::pair(std::move(refused), writer->append("thermal0", thermal_frame(1)));
    }();
    ASSERT_FALSE(record);
    EXPECT_EQ(record.error().kind, ErrorKind::device);
    ASSERT_FALSE(gap);
    const auto session = open_session(folder / "s");
    ASSERT_TRUE(session) << session.error().message();
    EXPECT_EQ(session->frames.size(), 1u);
  }
  ASSERT_TRUE(writer->append("thermal0", thermal_frame(2)));
  ASSERT_TRUE(writer->close());
  EXPECT_EQ(open_session(folder / "s")->frames.size(), 2u);
}

TEST(SessionWriter, CountsOfUnknownScaleAreNeverTemperatures) {
  const TempFolder folder;
  auto writer = SessionWriter::create(folder / "s");
  ASSERT_TRUE((*writer)->add_device(thermal_device()));
  RawCounts raw;
  cv::Mat dark, bright;
  thermal_pixels().convertTo(dark, CV_16U, 0.1, 4000);
  dark.convertTo(bright, CV_16U, 1, 200);
  std::vector<double> mean;
  for (const cv::Mat& counts : {dark, bright}) {
    Frame frame = test::frame_delivery(mean.size(), counts.clone()).frame;
    EXPECT_EQ(raw.apply(frame).has_value(), mean.empty());  // the stretch is told once
    mean.push_back(cv::mean(frame.pixels)[0]);
    const auto record = (*writer)->append("thermal0", frame);
    ASSERT_TRUE(record) << record.error().message();
    EXPECT_TRUE(record->thermal_is_gray);
    EXPECT_TRUE(record->has_flag(FrameFlag::raw_counts));
    EXPECT_FALSE(std::filesystem::exists(folder / ("s/" + record->file + ".json")));
  }
  EXPECT_GT(mean[1], mean[0] + 20);  // one stretch: brighter counts are brighter
  EXPECT_EQ(cv::norm(*read_image(folder / "s/thermal/originals/000001.tiff"), bright, cv::NORM_INF),
            0);
}

TEST(SessionWriter, ScaleOfHotScenesIsInTagSidecarAndQuality) {
  const TempFolder folder;
  auto writer = SessionWriter::create(folder / "s");
  ASSERT_TRUE(writer);
  DeviceInfo device;
  device.id = "thermal0";
  device.modality = Modality::thermal;
  ASSERT_TRUE((*writer)->add_device(device));
  Frame counted, encoded;
  counted.pixels = cv::Mat(8, 8, CV_16UC1, cv::Scalar(58657));  // 1173.14 K
  counted.kelvin_per_count = 0.02;
  encoded.encoded = *encode_thermal_tiff(counted.pixels, {0.02, 0});  // as a replay delivers it
  encoded.extension = ".tiff";
  for (const Frame& frame : {counted, encoded}) {
    const auto record = (*writer)->append("thermal0", frame);
    ASSERT_TRUE(record) << record.error().message();
    EXPECT_NEAR(record->quality->mean_level, 1173.14, 1e-6);
    EXPECT_NEAR(read_thermal_k(folder / "s" / record->file)->at<float>(0, 0), 1173.14, 1e-3);
    EXPECT_NE(test::get(folder / "s" / (record->file + ".json")).find("\"scale\":0.02"),
              std::string::npos);
  }
}

TEST(SessionWriter, ASessionThatIsMovedDeletedOrChangedMeanwhileIsAnError) {
  const TempFolder folder;
  const auto after = [&](const std::string& name, const std::function<void()>& change) {
    auto writer = *SessionWriter::create(folder / name);
    DeviceInfo device;
    device.id = "visible0";
    EXPECT_TRUE(writer->add_device(device));
    Frame frame;
    frame.pixels = cv::Mat(8, 8, CV_8UC1, cv::Scalar(7));
    EXPECT_TRUE(writer->append("visible0", frame));
    change();
    const auto stored = writer->append("visible0", frame);
    EXPECT_FALSE(stored) << name;
    EXPECT_FALSE(writer->append(EventRecord{"", 1, "nuc", ""})) << name;
    EXPECT_FALSE(writer->close()) << name;
    return stored ? std::string() : stored.error().message();
  };
  using ::testing::HasSubstr;
  namespace fs = std::filesystem;
  EXPECT_THAT(after("a", [&] { fs::remove_all(folder / "a"); }), HasSubstr("moved or deleted"));
  EXPECT_FALSE(fs::exists(folder / "a"));
  EXPECT_THAT(after("b", [&] { fs::rename(folder / "b", folder / "b2"); }),
              HasSubstr("moved or deleted"));
  EXPECT_FALSE(fs::exists(folder / "b"));
  EXPECT_EQ(open_session(folder / "b2")->frames.size(), 1u);
  EXPECT_THAT(after("c", [&] { fs::resize_file(folder / "c/manifest.jsonl", 0); }),
              HasSubstr("changed by another program"));
  EXPECT_THAT(after("d",
                    [&] {
                      test::put(folder / "d/manifest.jsonl.new", "{}\n");
                      fs::rename(folder / "d/manifest.jsonl.new", folder / "d/manifest.jsonl");
                    }),
              HasSubstr("moved or deleted"));
}

TEST(SessionWriter, ARecordThatWouldNotOpenLeavesNoFile) {
  const TempFolder folder;
  auto writer = SessionWriter::create(folder / "s");
  ASSERT_TRUE(writer);
  DeviceInfo device;
  device.id = "visible0";
  ASSERT_TRUE((*writer)->add_device(device));
  Frame frame;
  frame.pixels = cv::Mat(8, 8, CV_8UC3, cv::Scalar(1, 2, 3));
  frame.cam_from_world = Rigid3d{Eigen::Quaterniond(0, 0, 0, 0), {0, 0, 0}};
  EXPECT_FALSE((*writer)->append("visible0", frame));
  EXPECT_FALSE(std::filesystem::exists(folder / "s/visible"));
  frame.cam_from_world.reset();
  ASSERT_TRUE((*writer)->append("visible0", frame));
  ASSERT_TRUE((*writer)->close());
  EXPECT_TRUE(open_session(folder / "s"));
}

}  // namespace
}  // namespace orbitfuse
