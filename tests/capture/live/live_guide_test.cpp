// SPDX-License-Identifier: BSD-3-Clause
#include "capture/live/live_guide.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "tests/capture/scripted_source.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using namespace std::chrono_literals;

/// A session with one visible camera whose frames carry their azimuth in their grey level.
class LiveGuideTest : public ::testing::Test {
 protected:
  LiveGuideTest() {
    writer = *SessionWriter::create(folder / "s");
    DeviceInfo device;
    device.id = "visible0";
    EXPECT_TRUE(writer->add_device(device));
    options.plan.loop_elevations_deg = {20};
    options.plan.modalities = {Modality::visible};
    options.looks_per_second = 100;
  }

  static std::int64_t at_ns(double time_s) {
    return std::int64_t{1'000'000'000'000'000'000} + std::llround(time_s * 1e9);
  }

  /// Grey level g stands for azimuth 2 g; noise keeps the image sharp.
  FrameRecord record(int level, double time_s, bool blurred = false) {
    Frame frame;
    frame.id = next_id++;
    frame.host_time_ns = at_ns(time_s);
    frame.tracking = true;
    frame.pixels = cv::Mat(32, 32, CV_8UC1, cv::Scalar(level));
    for (int i = 0; i < 32; ++i)
      frame.pixels.at<std::uint8_t>(i, i) = static_cast<std::uint8_t>(level + (blurred ? 0 : 60));
    if (blurred) {
      for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 32; ++x)
          frame.pixels.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(level + y);
      }
    }
    return *writer->append("visible0", frame);
  }

  /// What a resting video camera delivers round a key.
  void film(LiveGuide& guide, int level, double time_s, bool blurred = false) {
    for (int i = 0; i < 3; ++i) guide.add(record(level, time_s + 0.03 * i, blurred));
  }

  static std::optional<OrbitPosition> find(const cv::Mat& image, Modality) {
    const int level = image.at<std::uint8_t>(0, 31) % 200;
    if (level == 199) return std::nullopt;
    return OrbitPosition{2.0 * level, 20, 0.1, 0};
  }

  static std::string words_of(const LiveGuide& guide, std::size_t camera) {
    return instruction_for(guide.cameras()[camera], Operator::at_terminal);
  }

  static cv::Mat boxes(int high, int low) {
    cv::Mat image(240, 320, CV_8UC1, cv::Scalar(low));
    for (int y = 0; y < 240; y += 80) {
      for (int x = 0; x < 320; x += 80) image(cv::Rect(x + 20, y + 20, 40, 40)).setTo(high);
    }
    return image;
  }

  Result<FrameRecord> stored(const cv::Mat& image, double at_s) {
    Frame frame;
    frame.id = next_id++;
    frame.host_time_ns = at_ns(at_s);
    frame.tracking = true;
    frame.pixels = image;
    return writer->append("visible0", frame);
  }

  /// Gives a frame to the guide and waits until it has been judged.
  static void show(LiveGuide& guide, const FrameRecord& frame) {
    guide.add(frame);
    const auto deadline = std::chrono::steady_clock::now() + 10s;
    while (guide.cameras()[0].judged_file != frame.file) {
      ASSERT_LT(std::chrono::steady_clock::now(), deadline);
      std::this_thread::sleep_for(1ms);
    }
  }

  test::TempFolder folder;
  std::unique_ptr<SessionWriter> writer;
  LiveGuideOptions options;
  std::uint64_t next_id = 0;
  double now_s = 0;
};

TEST_F(LiveGuideTest, RestingSharpFrameBecomesAStationInTheManifest) {
  {
    LiveGuide guide(*writer, options, find);
    show(guide, record(15, 0.0));  // speed unknown: proves nothing
    EXPECT_EQ(guide.done_count(Modality::visible), 0);
    EXPECT_EQ(guide.cameras()[0].refusal, Refusal::moving);
    show(guide, record(15, 0.25));
    EXPECT_EQ(guide.done_count(Modality::visible), 1);
    EXPECT_NEAR(guide.cameras()[0].position->azimuth_deg, 30, 1e-9);
    show(guide, record(25, 0.5));  // 80 degrees a second
    EXPECT_EQ(guide.cameras()[0].refusal, Refusal::moving);
    EXPECT_EQ(guide.done_count(Modality::visible), 1);
  }
  ASSERT_TRUE(writer->close());
  const auto session = open_session(folder / "s");
  ASSERT_TRUE(session) << session.error().message();
  ASSERT_EQ(session->frames.size(), 3u);
  EXPECT_TRUE(session->frames[0].tracking);
  EXPECT_FALSE(session->frames[1].tracking);
  EXPECT_EQ(session->frames[1].station->index, 1);
  EXPECT_TRUE(session->frames[2].tracking);
}

TEST_F(LiveGuideTest, BlurredFrameStaysATrackingFrame) {
  LiveGuide guide(*writer, options, find);
  show(guide, record(0, 0.0));
  show(guide, record(0, 0.25, true));
  EXPECT_EQ(guide.done_count(Modality::visible), 0);
}

TEST_F(LiveGuideTest, LosesThePositionWhenTheMatIsOutOfSight) {
  LiveGuide guide(*writer, options, find);
  show(guide, record(15, 0));
  EXPECT_TRUE(guide.cameras()[0].position);
  show(guide, record(199, 2));
  EXPECT_FALSE(guide.cameras()[0].position);
  EXPECT_EQ(guide.cameras()[0].instruction, "show the mat to the camera");
}

TEST_F(LiveGuideTest, OperatorsKeyFillsTheNextStation) {
  LiveGuide guide(*writer, options);
  film(guide, 15, 0);
  EXPECT_EQ(guide.done_count(Modality::visible), 0);
  guide.operator_at_station();
  film(guide, 15, 1);
  film(guide, 15, 2);
  EXPECT_EQ(guide.done_count(Modality::visible), 1);
  for (int i = 0; i < 11; ++i) {
    EXPECT_FALSE(guide.complete());
    guide.operator_at_station();
    film(guide, 15, 3 + i);
  }
  EXPECT_TRUE(guide.complete());
  EXPECT_FALSE(guide.error());
}

TEST_F(LiveGuideTest, AnotherScaleOfThermalCountsIsNoMotion) {
  DeviceInfo thermal;
  thermal.id = "thermal0";
  thermal.modality = Modality::thermal;
  ASSERT_TRUE(writer->add_device(thermal));
  options.plan.modalities = {Modality::thermal};
  LiveGuide guide(*writer, options);
  guide.operator_at_station();
  // The same squares, 300 K on 290 K, from the second frame on at 0.02 K a count.
  for (const double scale : {0.01, 0.02, 0.02}) {
    Frame frame;
    frame.id = next_id++;
    frame.host_time_ns = at_ns(++now_s);
    frame.tracking = true;
    boxes(150, 100).convertTo(frame.pixels, CV_16U, 0.2 / scale, 270 / scale);
    frame.kelvin_per_count = scale;
    const auto kept = writer->store("thermal0", frame);
    ASSERT_TRUE(kept) << kept.error().message();
    guide.add(kept->record, kept->pixels, kept->scale.scale);
    EXPECT_NE(guide.cameras()[0].refusal, Refusal::moving) << scale;
  }
  EXPECT_EQ(guide.done_count(Modality::thermal), 1);
}

TEST_F(LiveGuideTest, ABlurredFirstFrameIsNoStation) {
  LiveGuide guide(*writer, options);
  guide.operator_at_station();
  const auto stands = [&](const cv::Mat& image) {
    for (int i = 0; i < 3; ++i) guide.add(*stored(image, ++now_s));
    return guide.cameras()[0].refusal;
  };
  cv::Mat sharp = boxes(200, 60), blurred;
  cv::GaussianBlur(sharp, blurred, {}, 3);
  EXPECT_EQ(stands(blurred), Refusal::blurred);  // nothing sharper was ever seen
  cv::blur(sharp, blurred, {11, 1});             // shaken sideways: the level edges stay sharp
  EXPECT_EQ(stands(blurred), Refusal::blurred);
  EXPECT_EQ(stands(cv::Mat(sharp.size(), CV_8UC1, cv::Scalar(90))), Refusal::featureless);
  EXPECT_EQ(guide.done_count(Modality::visible), 0);
  EXPECT_EQ(stands(sharp), Refusal::none);
  EXPECT_EQ(guide.done_count(Modality::visible), 1);
}

TEST_F(LiveGuideTest, FramesThatDifferFromTheirNeighboursAreNoStation) {
  LiveGuide guide(*writer, options);
  const cv::Mat sharp = boxes(200, 60);
  const auto moved = [&](double shift_px) {
    cv::Mat image;
    const cv::Mat way = (cv::Mat_<double>(2, 3) << 1, 0, shift_px, 0, 1, 0);
    cv::warpAffine(sharp, image, way, sharp.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    return image;
  };
  guide.operator_at_station();
  for (int i = 0; i < 6; ++i) guide.add(*stored(moved(i % 2 ? 8 : 0), ++now_s));
  EXPECT_EQ(guide.cameras()[0].refusal, Refusal::moving);
  EXPECT_EQ(guide.cameras()[0].instruction, "too fast, hold still");
  EXPECT_EQ(guide.done_count(Modality::visible), 0);
  // Comes to rest: the second of three that agree is taken, not the first.
  std::vector<FrameRecord> resting;
  for (int i = 0; i < 3; ++i) {
    resting.push_back(*stored(moved(4 + 0.2 * i), ++now_s));
    EXPECT_EQ(guide.done_count(Modality::visible), 0);
    guide.add(resting.back());
  }
  EXPECT_EQ(guide.sectors()[0].best.at(Modality::visible).file, resting[1].file);
}

TEST_F(LiveGuideTest, StationsThatFramesCarryCountAtOnce) {
  LiveGuide guide(*writer, options);
  FrameRecord frame = record(15, 0);
  frame.tracking = false;
  frame.station = Station{0, 3, 90, 20, 5, 5};
  guide.add(frame);
  EXPECT_EQ(guide.done_count(Modality::visible), 1);
  frame.flags = {"nuc"};
  frame.station->azimuth_deg = 120;
  guide.add(frame);
  EXPECT_EQ(guide.done_count(Modality::visible), 1);
}

TEST_F(LiveGuideTest, TurntableCountsKeysAndTurns) {
  options.plan.loop_elevations_deg = {20, 50};
  options.turntable_step_deg = -15;  // every other step is a station
  LiveGuide guide(*writer, options);
  const auto at = [&] { return *guide.cameras()[0].position; };
  guide.operator_at_station();
  film(guide, 15, ++now_s);
  EXPECT_NEAR(at().azimuth_deg, 0, 1e-9);
  EXPECT_EQ(guide.done_count(Modality::visible), 1);
  guide.operator_at_station();
  film(guide, 15, ++now_s);
  EXPECT_NEAR(at().azimuth_deg, 345, 1e-9);
  EXPECT_EQ(guide.cameras()[0].refusal, Refusal::between_stations);
  EXPECT_EQ(guide.done_count(Modality::visible), 1);
  film(guide, 15, ++now_s);  // the table hasn't been turned on: nothing new is known
  EXPECT_EQ(guide.done_count(Modality::visible), 1);
  for (int step = 2; step < 48; ++step) {
    guide.operator_at_station();
    film(guide, 15, ++now_s);
  }
  EXPECT_NEAR(at().elevation_deg, 50, 1e-9);  // the second turn
  EXPECT_TRUE(guide.complete());
}

TEST_F(LiveGuideTest, SaysWhatToDoWithTheTableAndTheKey) {
  {
    LiveGuide guide(*writer, options);
    EXPECT_EQ(words_of(guide, 0), "go to azimuth 0°, 20° high, then press Enter");
  }
  {
    // A loop above is nearer than the next station, but the next key records the next station.
    LiveGuideOptions loops = options;
    loops.plan.loop_elevations_deg = {20, 45};
    LiveGuide guide(*writer, loops);
    guide.operator_at_station();
    film(guide, 15, 1);
    EXPECT_EQ(guide.done_count(Modality::visible), 1);
    EXPECT_EQ(words_of(guide, 0), "go to azimuth 30°, 20° high, then press Enter");
  }
  options.plan.loop_elevations_deg = {20, 50};
  options.turntable_step_deg = 30;
  LiveGuide guide(*writer, options);
  const auto words = [&] { return words_of(guide, 0); };
  EXPECT_EQ(words(), "put the table at its start, then press Enter or take the photo");
  guide.operator_at_station();
  film(guide, 15, 1);
  EXPECT_EQ(words(), "turn the table by 30°, then press Enter");
  for (int i = 1; i < 12; ++i) {
    guide.operator_at_station();
    if (i == 4) {
      film(guide, 15, 1 + i, true);
      EXPECT_EQ(words(), text(Refusal::blurred));
    }
    film(guide, 15, 1.5 + i);
  }
  EXPECT_EQ(words(), "turn the table by 30°, move the camera to 50° high, then press Enter");
  for (int i = 12; i < 24; ++i) {
    guide.operator_at_station();
    film(guide, 15, 1 + i);
  }
  EXPECT_EQ(words(), "visible: done");
}

TEST_F(LiveGuideTest, TurntableTriesAgainWhereAFrameWasBlurred) {
  options.turntable_step_deg = 30;
  LiveGuide guide(*writer, options);
  guide.operator_at_station();
  film(guide, 15, 0);
  guide.operator_at_station();
  film(guide, 15, 1, true);
  EXPECT_EQ(guide.cameras()[0].refusal, Refusal::blurred);
  EXPECT_EQ(guide.done_count(Modality::visible), 1);
  film(guide, 15, 2);
  EXPECT_EQ(guide.done_count(Modality::visible), 2);
  EXPECT_NEAR(guide.cameras()[0].position->azimuth_deg, 30, 1e-9);
}

TEST_F(LiveGuideTest, EachPhotoIsAStepOfTheTurntable) {
  options.turntable_step_deg = 30;
  {
    LiveGuide guide(*writer, options);
    for (int i = 0; i < 12; ++i) {
      EXPECT_FALSE(guide.complete());
      FrameRecord photo = record(15, i, i == 4);  // the fifth is blurred
      photo.flags = {"still"};
      guide.add(photo);
    }
    EXPECT_EQ(guide.done_count(Modality::visible), 11);
    EXPECT_NEAR(guide.cameras()[0].position->azimuth_deg, 330, 1e-9);
  }
  // Another turn after a restart: the photos that were chosen come back with their stations.
  std::vector<FrameRecord> earlier;
  for (int i = 0; i < 12; ++i) {
    FrameRecord photo = record(15, 20 + i, i == 4);
    photo.flags = {"still"};
    if (i != 4) photo.tracking = false, photo.station = Station{0, i, 30.0 * i, 20, 1, 1};
    earlier.push_back(photo);
  }
  LiveGuide guide(*writer, options);
  guide.resume(earlier);
  EXPECT_EQ(guide.done_count(Modality::visible), 11);
  for (int i = 0; i < 5; ++i) {
    FrameRecord photo = record(15, 40 + i);
    photo.flags = {"still"};
    guide.add(photo);
  }
  EXPECT_TRUE(guide.complete());
}

TEST_F(LiveGuideTest, PhotosSyncedAtTheEndBelongToTheKeyBeforeThem) {
  options.plan.loop_elevations_deg = {20, 50};
  options.turntable_step_deg = 30;
  LiveGuide guide(*writer, options);
  for (int i = 0; i < 24; ++i) guide.operator_at_station(at_ns(10 * i));
  for (int i = 23; i >= 0; --i) {  // the newest first
    FrameRecord photo = record(15, 10 * i + 3);
    photo.flags = {"still"};
    guide.add(photo);
    EXPECT_NEAR(guide.cameras()[0].position->azimuth_deg, 30 * (i % 12), 1e-9) << i;
    EXPECT_NEAR(guide.cameras()[0].position->elevation_deg, i < 12 ? 20 : 50, 1e-9) << i;
  }
  EXPECT_TRUE(guide.complete());
}

TEST_F(LiveGuideTest, PhotosWhoseTimeDoesNotTellTheirKeyAreRefused) {
  options.turntable_step_deg = 30;
  LiveGuide guide(*writer, options);
  for (int i = 0; i < 3; ++i) guide.operator_at_station(at_ns(10 * i + 0.5));
  const auto judged = [&](double time_s, const char* flag) {
    FrameRecord photo = record(15, time_s);
    if (time_s < -100) photo.host_time_ns.reset();
    photo.flags = {"still", flag};
    guide.add(photo);
    return guide.cameras()[0].refusal;
  };
  EXPECT_EQ(judged(-1000, ""), Refusal::position_unsure);        // no time
  EXPECT_EQ(judged(25, "file-time"), Refusal::position_unsure);  // when it was copied
  EXPECT_EQ(judged(-5, ""), Refusal::position_unsure);           // before the first key
  EXPECT_EQ(judged(10, ""), Refusal::position_unsure);           // some time in the second of a key
  EXPECT_EQ(guide.done_count(Modality::visible), 0);
  EXPECT_EQ(judged(10.7, ""), Refusal::none);
  EXPECT_NEAR(guide.cameras()[0].position->azimuth_deg, 30, 1e-9);
}

TEST_F(LiveGuideTest, ABetterFrameAfterAResumeTakesTheStationOver) {
  FrameRecord earlier = record(15, 0);
  earlier.tracking = false;
  earlier.station = Station{0, 1, 30, 20, 1, 1};
  earlier.quality->sharpness /= 2;
  ASSERT_TRUE(writer->amend(earlier));
  {
    LiveGuide guide(*writer, options, find);
    guide.resume({earlier});
    EXPECT_EQ(guide.done_count(Modality::visible), 1);
    FrameRecord photo = record(15, 5);
    photo.flags = {"still"};
    guide.add(photo);
    guide.finish();
    EXPECT_EQ(guide.done_count(Modality::visible), 1);
    EXPECT_FALSE(guide.error());
  }
  ASSERT_TRUE(writer->close());
  const auto session = open_session(folder / "s");
  ASSERT_TRUE(session) << session.error().message();
  int stations = 0;
  for (const FrameRecord& frame : session->frames) {
    stations += !frame.tracking;
    EXPECT_TRUE(frame.tracking || frame.file != earlier.file);
  }
  EXPECT_EQ(stations, 1);
}

TEST_F(LiveGuideTest, ANearlyBlackFrameIsRefused) {
  LiveGuide guide(*writer, options);
  const auto judged = [&](int level) {
    guide.operator_at_station();
    film(guide, level, level);
    return guide.cameras()[0].refusal;
  };
  EXPECT_EQ(judged(2), Refusal::badly_exposed);  // no pixel of it is 0
  EXPECT_EQ(guide.done_count(Modality::visible), 0);
  EXPECT_EQ(judged(15), Refusal::none);
}

TEST_F(LiveGuideTest, PhotosCopiedAllAtOnceAreAllJudged) {
  LiveGuide guide(*writer, options, find);
  for (int i = 1; i <= 12; ++i) {
    FrameRecord photo = record(15 * i, i);
    photo.flags = {"still"};
    guide.add(photo);
  }
  guide.finish();
  EXPECT_EQ(guide.done_count(Modality::visible), 12);
  EXPECT_TRUE(guide.complete());
}

TEST_F(LiveGuideTest, ResumedKeySessionGoesOnAfterItsLastStation) {
  options.plan.loop_elevations_deg = {20, 50};
  options.turntable_step_deg = -30;
  std::vector<FrameRecord> earlier;
  for (int i = 0; i < 14; ++i) {  // a turn and two steps: at 330 degrees, in the second loop
    FrameRecord frame = record(15, i);
    const int index = (12 - i % 12) % 12;
    if (i != 7) {  // the operator went on without a good frame
      frame.tracking = false;
      frame.station = Station{i / 12, index, 30.0 * index, i < 12 ? 20.0 : 50.0, 1, 1};
    }
    earlier.push_back(frame);
  }
  LiveGuide guide(*writer, options);
  guide.resume(earlier);
  EXPECT_EQ(guide.done_count(Modality::visible), 13);
  EXPECT_EQ(words_of(guide, 0), "turn the table by 30°, then press Enter");
  guide.operator_at_station();
  film(guide, 15, 20);
  EXPECT_NEAR(guide.cameras()[0].position->azimuth_deg, 300, 1e-9);
  EXPECT_NEAR(guide.cameras()[0].position->elevation_deg, 50, 1e-9);
  EXPECT_EQ(guide.done_count(Modality::visible), 14);
}

/// A table with a video camera (visible, stations by the key) and a camera that takes photos.
class MixedTableTest : public LiveGuideTest {
 protected:
  MixedTableTest() {
    DeviceInfo device;
    device.id = "thermal0";
    device.modality = Modality::thermal;
    EXPECT_TRUE(writer->add_device(device));
    options.plan.modalities = {Modality::visible, Modality::thermal};
    options.turntable_step_deg = 30;
  }
  void key(LiveGuide& guide) {
    guide.operator_at_station(at_ns(now_s + 1));
    film(guide, 15, ++now_s);
  }
  void photo(LiveGuide& guide, bool blurred = false) {
    FrameRecord frame = record(15, ++now_s, blurred);
    frame.modality = Modality::thermal;
    frame.device = "thermal0";
    frame.flags = {"still"};
    guide.add(frame);
  }
  static double azimuth(const LiveGuide& guide, Modality modality) {
    return guide.cameras()[modality == Modality::visible ? 0 : 1].position->azimuth_deg;
  }
};

TEST_F(MixedTableTest, KeyAndPhotoAtOneStationAreOneStep) {
  LiveGuide guide(*writer, options);
  for (int i = 0; i < 12; ++i) {
    key(guide);
    if (i == 4) photo(guide, true);  // taken again below
    photo(guide);
    EXPECT_NEAR(azimuth(guide, Modality::visible), 30 * i, 1e-9);
    EXPECT_NEAR(azimuth(guide, Modality::thermal), 30 * i, 1e-9);
  }
  EXPECT_TRUE(guide.complete());
}

TEST_F(MixedTableTest, PhotoBeforeTheKeyIsTheSameStep) {
  LiveGuide guide(*writer, options);
  for (int i = 0; i < 12; ++i) {
    photo(guide);
    key(guide);
    EXPECT_NEAR(azimuth(guide, Modality::visible), 30 * i, 1e-9);
    EXPECT_NEAR(azimuth(guide, Modality::thermal), 30 * i, 1e-9);
  }
  EXPECT_TRUE(guide.complete());
}

TEST_F(MixedTableTest, CountedPhotosMayComeLate) {
  options.plan.loop_elevations_deg = {20, 50};
  LiveGuide guide(*writer, options);
  photo(guide);
  for (int i = 0; i < 3; ++i) key(guide);
  for (int i = 1; i < 3; ++i) {
    photo(guide);
    EXPECT_NEAR(azimuth(guide, Modality::thermal), 30 * i, 1e-9);
    EXPECT_NEAR(guide.cameras()[1].position->elevation_deg, 20, 1e-9);
  }
  EXPECT_EQ(guide.done_count(Modality::thermal), 3);
}

TEST_F(MixedTableTest, AStationWithoutItsPhotoDoesNotShiftTheNext) {
  LiveGuide guide(*writer, options);
  for (int i = 0; i < 12; ++i) {
    key(guide);
    if (i != 3) photo(guide);
  }
  EXPECT_NEAR(azimuth(guide, Modality::thermal), 330, 1e-9);
  EXPECT_EQ(guide.done_count(Modality::thermal), 11);
}

TEST_F(MixedTableTest, SecondCameraAfterAResumeMakesItsOwnFirstTurn) {
  options.plan.loop_elevations_deg = {20, 50};
  std::vector<FrameRecord> earlier;
  for (int i = 0; i < 12; ++i) {
    earlier.push_back(record(15, ++now_s));
    earlier.back().tracking = false;
    earlier.back().station = Station{0, i, 30.0 * i, 20, 1, 1};
  }
  LiveGuide guide(*writer, options);
  guide.resume(earlier);
  EXPECT_EQ(words_of(guide, 1), "turn the table by 30°, then press Enter or take the photo");
  for (int i = 0; i < 12; ++i) photo(guide);
  EXPECT_EQ(guide.done_count(Modality::thermal), 12);
  EXPECT_NEAR(guide.cameras()[1].position->elevation_deg, 20, 1e-9);
  photo(guide);
  EXPECT_NEAR(guide.cameras()[1].position->elevation_deg, 50, 1e-9);
  EXPECT_EQ(guide.done_count(Modality::thermal), 13);
  key(guide);  // the visible camera's second turn
  EXPECT_NEAR(guide.cameras()[0].position->elevation_deg, 50, 1e-9);
}

/// What the key is differs: there is no Enter on a phone.
TEST_F(LiveGuideTest, ThePageSaysButtonWhereTheTerminalSaysEnter) {
  LiveGuide guide(*writer, options);
  const LiveCamera camera = guide.cameras()[0];
  EXPECT_EQ(instruction_for(camera, Operator::at_page),
            "go to azimuth 0°, 20° high, then tap At the station");
  EXPECT_EQ(camera.target->azimuth_deg, 0);
  EXPECT_EQ(camera.of, 12);
  const auto taken = guide.operator_at_station();
  ASSERT_TRUE(taken);
  EXPECT_EQ(*taken, "visible: the next good frame is azimuth 0°, 20° high");
}

TEST_F(LiveGuideTest, AKeyThatNobodyWaitsForIsRefused) {
  options.stations_come_with_frames = true;
  LiveGuide guide(*writer, options);
  const auto taken = guide.operator_at_station();
  ASSERT_FALSE(taken);
  EXPECT_NE(taken.error().message().find("by themselves"), std::string::npos);
}

/// The image comes with the frame: nothing is read back, not even when the file is gone.
TEST_F(LiveGuideTest, FramesAreNotDecodedAgain) {
  LiveGuide guide(*writer, options);
  guide.operator_at_station();
  for (int i = 0; i < 3; ++i) {
    const FrameRecord frame = *stored(boxes(200, 60), ++now_s);
    std::filesystem::remove(folder / "s" / frame.file);
    guide.add(frame, boxes(200, 60));
  }
  EXPECT_EQ(guide.done_count(Modality::visible), 1);
}

TEST_F(LiveGuideTest, OptionsAreChecked) {
  options.turntable_step_deg = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(options.validate().error().where, "guide.turntable_step_deg");
  options = {};
  options.turntable_step_deg = 0;  // no table turns so; without one it is left out
  EXPECT_EQ(options.validate().error().where, "guide.turntable_step_deg");
  options = {};
  options.looks_per_second = 0;
  EXPECT_EQ(options.validate().error().where, "guide.looks_per_second");
  options = {};
  options.plan.spacing_deg = 7;
  EXPECT_EQ(options.validate().error().where, "guide.spacing_deg");
}

}  // namespace
}  // namespace orbitfuse
