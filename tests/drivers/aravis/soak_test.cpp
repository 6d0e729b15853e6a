// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <iterator>
#include <memory>

#include "tests/drivers/aravis/stream_harness.hpp"

namespace orbitfuse::aravis {
namespace {

using namespace std::chrono_literals;
using orbitfuse::testing::GevFaults;
using orbitfuse::testing::GevSimulator;

/// 640x480 Mono16 at 30 Hz for a minute (ORBITFUSE_SOAK_S: longer).
class AravisSoak : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!camera.start_when_free()) GTEST_SKIP() << "the GVCP port 3956 on loopback is in use";
    const char* wanted = std::getenv("ORBITFUSE_SOAK_S");
    count = static_cast<std::uint64_t>(30 * (wanted ? std::atof(wanted) : 60.0));
  }
  /// Null when it doesn't start.
  std::unique_ptr<AravisSource> started(double packet_loss, bool answer_resend) {
    GevFaults faults;
    faults.packet_loss = packet_loss;
    faults.answer_resend = answer_resend;
    camera.set_faults(faults);
    AravisOptions options;
    options.camera = "127.0.0.1";
    options.profiles = std::filesystem::path(ORBITFUSE_SOURCE_DIR) / "config/cameras";
    auto source = std::make_unique<AravisSource>(options);
    return source->start() ? std::move(source) : nullptr;
  }
  void expect_every_frame(double packet_loss);

  GevSimulator camera;
  std::uint64_t count = 0;
};

void AravisSoak::expect_every_frame(double packet_loss) {
  const auto source = started(packet_loss, true);
  ASSERT_TRUE(source);
  const Tally tally = drain(*source, std::chrono::seconds(count / 10),
                            [&](const Tally& t) { return t.frames + t.rejected >= count; });
  EXPECT_EQ(tally.frames, count);
  EXPECT_EQ(tally.span(), count);
  EXPECT_EQ(tally.rejected + tally.wrong_bits + tally.not_rising, 0u);
  EXPECT_NEAR(tally.rate_hz(), 30, 0.3);  // by the camera's stamps
  std::printf(
      "frames %llu, dropped packets %llu, resent %llu, clock residual %.2f ms, drift %.1f ppm\n",
      static_cast<unsigned long long>(tally.frames),
      static_cast<unsigned long long>(camera.packets_dropped()),
      static_cast<unsigned long long>(camera.resends_answered()),
      1000 * source->clock().residual_rms_s(), source->clock().drift_ppm());
}

TEST_F(AravisSoak, CleanMinute) { expect_every_frame(0); }
TEST_F(AravisSoak, OnePercentLossWithResend) { expect_every_frame(0.01); }

/// Nine frames of ten are damaged: each is counted, and every other is stored.
TEST_F(AravisSoak, HalfPercentLossWithoutResend) {
  const auto source = started(0.005, false);
  ASSERT_TRUE(source);
  const Tally tally = drain(*source, std::chrono::seconds(count / 10),
                            [&](const Tally& t) { return t.span() >= count; });
  const std::uint64_t sent = camera.frames_sent(), whole = sent - camera.frames_damaged();
  std::printf(
      "span %llu of %llu sent: %llu frames stored of %llu whole ones, %llu rejected, %llu "
      "missing\n",
      static_cast<unsigned long long>(tally.span()), static_cast<unsigned long long>(sent),
      static_cast<unsigned long long>(tally.frames), static_cast<unsigned long long>(whole),
      static_cast<unsigned long long>(tally.rejected),
      static_cast<unsigned long long>(tally.span() - tally.frames - tally.rejected));
  EXPECT_EQ(tally.wrong_bits + tally.not_rising, 0u);
  // Frames under way at either end are the difference.
  EXPECT_NEAR(static_cast<double>(tally.span()), static_cast<double>(sent), 20);
  EXPECT_NEAR(static_cast<double>(tally.frames), static_cast<double>(whole), 5);
}

int threads_of_this_process() {
  return static_cast<int>(std::distance(std::filesystem::directory_iterator("/proc/self/task"),
                                        std::filesystem::directory_iterator()));
}

/// Each lost connection is destroyed on a thread of its own.
TEST_F(AravisSoak, OutagesLeaveNoThreadsBehind) {
  const auto source = started(0, true);
  ASSERT_TRUE(source);
  const auto three = [](const Tally& t) { return t.frames >= 3; };
  drain(*source, 10s, three);
  const int streaming = threads_of_this_process();
  for (int outage = 0; outage < 3; ++outage) {
    camera.kill();
    drain(*source, 5s, [](const Tally& t) { return t.has("disconnected"); });
    ASSERT_TRUE(camera.start());
    EXPECT_TRUE(drain(*source, 10s, three).has("reconnected"));
  }
  const auto limit = testing_clock::now() + 10s;
  while (threads_of_this_process() > streaming && testing_clock::now() < limit)
    drain(*source, 100ms);
  EXPECT_LE(threads_of_this_process(), streaming);
  camera.kill();
  drain(*source, 5s, [](const Tally& t) { return t.has("disconnected"); });
  source->stop();
  const auto end = testing_clock::now() + 20s;  // what is going down needs its time-outs
  while (threads_of_this_process() >= streaming && testing_clock::now() < end)
    std::this_thread::sleep_for(100ms);
  EXPECT_LT(threads_of_this_process(), streaming);
}

}  // namespace
}  // namespace orbitfuse::aravis
