// SPDX-License-Identifier: BSD-3-Clause
// Videos are made here, with OpenCV's writer over FFmpeg.
#include "drivers/stills/video_frames.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <utility>

#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "drivers/stills/import.hpp"
#include "tests/support/says.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

constexpr int width = 320, height = 180;

class VideoFrames : public ::testing::Test {
 protected:
  void SetUp() override {
    cv::Mat noise(height, 4 * width, CV_8UC3);
    cv::RNG(5).fill(noise, cv::RNG::UNIFORM, 0, 255);
    cv::resize(noise, scene, {}, 0.125, 0.125, cv::INTER_AREA);
    cv::resize(scene, scene, noise.size(), 0, 0, cv::INTER_NEAREST);
    cv::normalize(scene, scene, 0, 255, cv::NORM_MINMAX);
  }
  /// The scene from `left` on, blurred or not.
  cv::Mat view(int left, bool blurred = false) const {
    cv::Mat image = scene(cv::Rect(left, 0, width, height)).clone();
    if (blurred) cv::GaussianBlur(image, image, {}, 5);
    return image;
  }
  std::string write(const std::string& name, const std::vector<cv::Mat>& frames,
                    const char* codec = "mp4v") const {
    const std::string file = (folder / name).string();
    cv::VideoWriter writer(file, cv::CAP_FFMPEG,
                           cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]), 30,
                           frames.empty() ? cv::Size(width, height) : frames.front().size());
    EXPECT_TRUE(writer.isOpened());
    for (const cv::Mat& frame : frames) writer.write(frame);
    return file;
  }
  /// A walk with a pause in the middle; every third frame is sharp.
  std::vector<cv::Mat> walk() const {
    std::vector<cv::Mat> frames;
    for (int i = 0; i < 90; ++i)
      frames.push_back(view(8 * std::min(i, 60) - 8 * std::clamp(i - 30, 0, 15), i % 3 != 0));
    return frames;
  }
  Result<VideoAccount> take(const std::string& file, VideoOptions options = {}) {
    taken.clear();
    return take_video_frames(file, options, {}, [&](const VideoFrame& frame) -> Status {
      taken.push_back({frame.index, frame.time_ns, frame.image.clone()});
      return {};
    });
  }
  static void expect_exact(const VideoAccount& a) {
    EXPECT_GE(a.less_sharp(), 0);
    EXPECT_EQ(a.frames, a.taken + a.less_sharp() + a.blurred + a.featureless + a.other_size +
                            a.not_read_again);
  }

  test::TempFolder folder;
  cv::Mat scene;
  std::vector<VideoFrame> taken;
};

TEST_F(VideoFrames, TheSharpestOfEachStretchIsTakenAndEveryFrameIsAccountedFor) {
  const auto account = take(write("orbit.mp4", walk()));
  ASSERT_TRUE(account) << account.error().message();
  EXPECT_EQ(account->frames, 90);
  EXPECT_EQ(account->taken, static_cast<std::int64_t>(taken.size()));
  expect_exact(*account);
  EXPECT_GE(taken.size(), 8u);
  EXPECT_LE(taken.size(), 31u);
  for (const VideoFrame& frame : taken) {
    EXPECT_EQ(frame.index % 3, 0) << "a blurred frame beside a sharp one";
    EXPECT_NEAR(static_cast<double>(frame.time_ns.value_or(0)),
                1e9 * static_cast<double>(frame.index) / 30, 0.04e9);
  }
  for (std::size_t i = 1; i < taken.size(); ++i) EXPECT_GT(taken[i].index, taken[i - 1].index);
}

TEST_F(VideoFrames, NoMoreThanAskedForAndSpreadOverTheWay) {
  VideoOptions options;
  options.max_frames = 6;
  const auto account = take(write("orbit.mp4", walk()), options);
  ASSERT_TRUE(account);
  EXPECT_GE(taken.size(), 4u);
  EXPECT_LE(taken.size(), 6u);
  EXPECT_GT(taken.back().index, 50);
}

TEST_F(VideoFrames, NeverMoreThanAskedForWhateverTheNumber) {
  const std::string file = write("orbit.mp4", walk());
  for (int most = 2; most < 10; ++most) {
    VideoOptions options;
    options.max_frames = most;
    ASSERT_TRUE(take(file, options));
    EXPECT_LE(taken.size(), static_cast<std::size_t>(most));
  }
}

TEST_F(VideoFrames, TwoNeighboursAreOneView) {
  // A steady walk of 8 px (0.025 widths) a frame; the sharpest are pairs, one after the other.
  std::vector<cv::Mat> frames;
  for (int i = 0; i < 60; ++i) frames.push_back(view(8 * i, i % 8 > 1));
  VideoOptions options;
  options.max_edge_px = 100;
  for (const double step : {0.06, 0.08, 0.1, 0.12, 0.15, 0.2}) {
    options.min_step = step;
    ASSERT_TRUE(take(write("pairs.mp4", frames), options));
    ASSERT_GE(taken.size(), 3u);
    for (std::size_t i = 1; i < taken.size(); ++i)
      EXPECT_GT(taken[i].index, taken[i - 1].index + 1) << "step " << step;
  }
}

TEST_F(VideoFrames, WhatIsNotReachedTheSecondTimeIsTold) {
  const std::string file = write("orbit.avi", walk(), "MJPG");
  const std::string whole = *read_file(file);
  Progress progress;
  bool cut = false;
  const auto account = take_video_frames(file, {}, progress, [&](const VideoFrame&) -> Status {
    if (!std::exchange(cut, true)) fs::resize_file(file, whole.size() / 2);
    return {};
  });
  ASSERT_TRUE(account) << account.error().message();
  expect_exact(*account);
  EXPECT_GT(account->not_read_again, 0);
  EXPECT_THAT(account->words(), test::says("could not be read a second time"));
}

TEST_F(VideoFrames, ANameWithAColonIsAFile) {
  const std::string file = write("orbit.mp4", walk());
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  fs::rename("orbit.mp4", "tcp:walk.mp4");
  const auto account = take("tcp:walk.mp4");
  fs::current_path(before);
  EXPECT_TRUE(account) << account.error().message();
}

TEST_F(VideoFrames, TheFingerprintTellsWhatDiffersAtTheEnd) {
  for (const std::size_t size : {100u, 600'000u, 1'048'576u, 3'000'000u}) {
    std::string bytes(size, 'x');
    test::put(folder / "a.mp4", bytes);
    bytes.back() = 'y';
    test::put(folder / "b.mp4", bytes);
    EXPECT_NE(video_fingerprint(folder / "a.mp4"), video_fingerprint(folder / "b.mp4")) << size;
  }
}

TEST_F(VideoFrames, AClipAmongPhotosIsLeftOutByWordsUnlessItIsNamed) {
  for (int i = 0; i < 4; ++i)
    cv::imwrite((folder / fmt::format("IMG_{}.JPG", i)).string(), view(9 * i));
  const std::string clip = write("IMG_2.MOV", walk());
  ImportOptions options;
  options.visible = {folder.path()};
  options.visible_stations = DeclaredStations{};
  const auto photos = import_session(options, folder / "photos");
  ASSERT_TRUE(photos) << photos.error().message();
  EXPECT_EQ(photos->visible, 4);
  EXPECT_THAT(photos->warnings, test::one_says("left out", "IMG_2.MOV", "name a video itself"));
  options.visible_stations.reset();
  options.visible = {folder.path(), clip};
  const auto both = import_session(options, folder / "both");
  ASSERT_TRUE(both) << both.error().message();
  EXPECT_GT(both->visible, 8);
  EXPECT_THAT(both->warnings, test::none_says("name a video itself"));
}

TEST_F(VideoFrames, BlurredStretchesAndEmptyOnesAreToldAndNotTaken) {
  std::vector<cv::Mat> frames;
  for (int i = 0; i < 40; ++i) frames.push_back(view(8 * i, i >= 20));
  auto account = take(write("blurred.mp4", frames));
  ASSERT_TRUE(account);
  expect_exact(*account);
  EXPECT_GT(account->blurred, 0);
  EXPECT_THAT(account->words(), test::says("film slower"));
  for (const VideoFrame& frame : taken) EXPECT_LT(frame.index, 22);

  account = take(write(
      "gray.mp4", std::vector<cv::Mat>(10, cv::Mat(height, width, CV_8UC3, cv::Scalar::all(90)))));
  ASSERT_TRUE(account);
  EXPECT_EQ(account->taken, 0);
  EXPECT_EQ(account->featureless, 1);

  account = take(write("still.mp4", std::vector<cv::Mat>(12, view(40))));
  ASSERT_TRUE(account);
  EXPECT_EQ(account->taken, 1);
  EXPECT_THAT(account->words(), test::says("hardly moved"));
}

/// Sets the matrix of the video's track header, as phones that were held upright do.
void turn_clockwise(const std::string& file) {
  std::string bytes = *read_file(file);
  const std::size_t at = bytes.find("tkhd");
  ASSERT_NE(at, std::string::npos);
  const std::size_t matrix = at + 4 + 4 + 20 + 16;  // version 0: times, ids, length, layer, volume
  const auto put = [&](int index, std::uint32_t value) {
    for (int i = 0; i < 4; ++i)
      bytes[matrix + static_cast<std::size_t>(4 * index + i)] =
          static_cast<char>(value >> (24 - 8 * i));
  };
  for (const auto& [index, value] : {std::pair{0, 0u}, {1, 0x10000u}, {3, 0xffff0000u}, {4, 0u}})
    put(index, value);
  test::put(file, bytes);
}

TEST_F(VideoFrames, ItsRotationIsApplied) {
  const std::string file = write("upright.mp4", std::vector<cv::Mat>(5, view(0)));
  turn_clockwise(file);
  ASSERT_TRUE(take(file));
  ASSERT_EQ(taken.size(), 1u);
  cv::Mat turned;
  cv::rotate(view(0), turned, cv::ROTATE_90_CLOCKWISE);
  ASSERT_EQ(taken[0].image.size(), turned.size());
  cv::Mat other;
  cv::rotate(turned, other, cv::ROTATE_180);
  EXPECT_LT(cv::norm(taken[0].image, turned, cv::NORM_L1),
            0.7 * cv::norm(taken[0].image, other, cv::NORM_L1));
}

TEST_F(VideoFrames, CutDamagedEmptyAndEndlessOnesHaveDefinedAnswers) {
  const std::string whole = *read_file(write("orbit.mp4", walk()));
  const std::string avi = *read_file(write("orbit.avi", walk(), "MJPG"));
  test::put(folder / "cut.mp4", whole.substr(0, whole.size() / 2));  // the index is at its end
  auto account = take((folder / "cut.mp4").string());
  ASSERT_FALSE(account);
  EXPECT_EQ(account.error().kind, ErrorKind::input);

  test::put(folder / "cut.avi", avi.substr(0, avi.size() / 2));
  account = take((folder / "cut.avi").string());
  if (account) {
    EXPECT_LT(account->frames, 60);
    EXPECT_GT(account->frames, 20);
    expect_exact(*account);
    EXPECT_THAT(account->words(), test::says("cut off or damaged"));
  } else {
    EXPECT_EQ(account.error().kind, ErrorKind::input);
  }

  write("none.avi", {}, "MJPG");
  EXPECT_FALSE(take((folder / "none.avi").string()));
  for (const std::string& content : {std::string(), std::string("#EXTM3U\nhttp://127.0.0.1:1/x"),
                                     std::string(5000, '\0'), whole.substr(0, 40)}) {
    test::put(folder / "odd.mp4", content);
    EXPECT_FALSE(take((folder / "odd.mp4").string()));
  }
  EXPECT_FALSE(take("/dev/zero"));
  EXPECT_FALSE(take((folder / "missing.mp4").string()));

  VideoOptions short_one;
  short_one.max_looked_at = 30;
  account = take((folder / "orbit.mp4").string(), short_one);
  ASSERT_TRUE(account);
  EXPECT_EQ(account->frames, 30);
  EXPECT_THAT(account->words(), test::says("the video goes on"));
}

TEST_F(VideoFrames, AreImportedWithTheAccountInWords) {
  write("orbit.mp4", walk());
  fs::copy_file(folder / "orbit.mp4", folder / "orbit (1).mp4");
  test::put(folder / "broken.mov", "\1\2\3\4ftypqt  and nothing else");
  ImportOptions options;
  options.visible = {folder.path()};
  const auto report = import_session(options, folder / "session");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_GE(report->visible, 8);
  EXPECT_THAT(report->warnings, test::one_says("orbit", "of 90 frames"));
  EXPECT_THAT(report->warnings, test::one_says("left out", "broken.mov"));
  EXPECT_THAT(report->warnings, test::one_says("the same image as"));
  const Session& session = report->session;
  std::int64_t before = -1;
  for (const FrameRecord& frame : session.frames) {
    EXPECT_EQ(cv::Size(frame.width, frame.height), cv::Size(width, height));
    EXPECT_THAT(frame.source, test::says(".mp4#"));
    const std::int64_t time_ns = frame.device_time_ns.value_or(0);  // the first is at 0
    EXPECT_GT(time_ns, before);
    before = time_ns;
    EXPECT_TRUE(read_visible(session.path_of(frame)));
  }
  EXPECT_TRUE(rehearse_import(options, folder / "other"));

  options.visible_stations = DeclaredStations{};
  const auto declared = import_session(options, folder / "declared");
  ASSERT_FALSE(declared);
  EXPECT_EQ(declared.error().kind, ErrorKind::usage);
  EXPECT_THAT(declared.error().message(), test::says("a video"));
}

TEST(VideoOptions, NonsenseIsNamed) {
  for (const auto& change : std::vector<std::function<void(VideoOptions&)>>{
           [](VideoOptions& o) { o.max_frames = 1; },
           [](VideoOptions& o) { o.min_step = std::nan(""); },
           [](VideoOptions& o) { o.max_edge_px = 0; },
           [](VideoOptions& o) { o.max_looked_at = 0; }}) {
    VideoOptions options;
    change(options);
    EXPECT_FALSE(options.validate());
  }
}

}  // namespace
}  // namespace orbitfuse
