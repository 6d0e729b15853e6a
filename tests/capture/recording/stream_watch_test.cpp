// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/stream_watch.hpp"

#include <gtest/gtest.h>

namespace orbitfuse {
namespace {

using std::chrono::milliseconds;

Delivery of_kind(Delivery::Kind kind) {
  Delivery delivery;
  delivery.kind = kind;
  return delivery;
}

StreamStatus told(const StreamWatch& watch) {
  StreamStatus status;
  watch.tell(status);
  return status;
}

TEST(StreamWatch, OnlyATimeoutAfterTheTimeSetIsSilence) {
  StreamWatch watch;
  const Delivery timeout = of_kind(Delivery::Kind::timeout);
  watch.see(timeout, milliseconds(3600'000), false);
  EXPECT_FALSE(told(watch).silent);
  watch.see(timeout, milliseconds(-1), false);
  EXPECT_TRUE(told(watch).silent);
  watch.see(of_kind(Delivery::Kind::frame), milliseconds(-1), false);
  EXPECT_FALSE(told(watch).silent);
}

TEST(StreamWatch, FilesAreSilentOnlyWhileTheirFolderIsGone) {
  StreamWatch watch;
  const Delivery timeout = of_kind(Delivery::Kind::timeout);
  watch.see(timeout, milliseconds(-1), true);
  EXPECT_FALSE(told(watch).silent);
  watch.see(event_delivery(EventKind::disconnected, "gone"), milliseconds(-1), true);
  watch.see(timeout, milliseconds(-1), true);
  EXPECT_TRUE(told(watch).silent);
}

TEST(StreamWatch, AnOutageLastsUntilTheCameraIsBack) {
  StreamWatch watch;
  EXPECT_FALSE(watch.away());
  watch.note(event_delivery(EventKind::twin, "another of the same name"));
  ASSERT_TRUE(watch.away());
  EXPECT_EQ(watch.away()->why, "another of the same name");
  EXPECT_EQ(told(watch).notice, "another of the same name");
  watch.note(event_delivery(EventKind::reconnected, "back"));
  EXPECT_FALSE(watch.away());
  EXPECT_EQ(told(watch).notice, "");
}

TEST(StreamWatch, AnOutageAtTheEndStopsGrowingThere) {
  StreamWatch watch;
  watch.note(event_delivery(EventKind::disconnected, "gone"));
  watch.end();
  const double at_the_end_s = watch.away()->seconds;
  EXPECT_GE(at_the_end_s, 0);
  EXPECT_EQ(watch.away()->seconds, at_the_end_s);
}

/// They were taken, so no count tells of them.
TEST(StreamWatch, PhotosWithTransparentPixelsAreForTheOperator) {
  StreamWatch watch;
  watch.note(event_delivery(EventKind::transparent, "a.png: 50 % of its pixels"));
  EXPECT_EQ(told(watch).notice, "a.png: 50 % of its pixels");
  EXPECT_FALSE(watch.away());
}

/// A TIFF with a preview behind its image.
TEST(StreamWatch, AFileOfWhichOnlyAPartIsLeftOutIsNotPassedOver) {
  StreamWatch watch;
  Delivery part = event_delivery(EventKind::ignored, "a.tif: page 2 (80x60, 8-bit)");
  part.kept = true;
  watch.note(part);
  EXPECT_EQ(told(watch).passed_over, 0u);
  EXPECT_EQ(told(watch).notice, "a.tif: page 2 (80x60, 8-bit)");
}

TEST(StreamWatch, OfWhatWasPassedOverTheLastThreeAreNamed) {
  StreamWatch watch;
  for (const char* file : {"a", "b", "c", "d"})
    watch.note(event_delivery(EventKind::ignored, file));
  watch.note(event_delivery(EventKind::repeated_id, "7"));
  const StreamStatus status = told(watch);
  EXPECT_EQ(status.passed_over, 4u);
  EXPECT_EQ(status.passed_over_last, (std::vector<std::string>{"b", "c", "d"}));
  EXPECT_EQ(status.repeated, 1u);
}

TEST(StreamWatch, CorrectionsAreCountedWhetherTheyHappenedOrNot) {
  StreamWatch watch;
  watch.note(event_delivery(EventKind::nuc, "done"));
  EXPECT_EQ(told(watch).correction, "shutter correction (NUC): done");
  watch.note(event_delivery(EventKind::nuc_failed, "refused"));
  EXPECT_EQ(told(watch).correction, "no shutter correction (NUC): refused");
  EXPECT_EQ(told(watch).corrections, 2u);
}

}  // namespace
}  // namespace orbitfuse
