// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include "tests/drivers/aravis/stream_harness.hpp"

namespace orbitfuse::aravis {
namespace {

using namespace std::chrono_literals;
using orbitfuse::testing::GevFaults;
using orbitfuse::testing::GevSimulator;

/// 640x480 Mono16 at 30 Hz for a minute (ORBITFUSE_SOAK_S: longer), clean and with 1 % loss.
void soak(double loss) {
  GevSimulator camera;
  bool up = false;
  for (int i = 0; i < 100 && !(up = camera.start()); ++i) usleep(100'000);
  if (!up) GTEST_SKIP() << "the GVCP port 3956 on loopback is in use";
  GevFaults faults;
  faults.packet_loss = loss;
  camera.set_faults(faults);
  AravisOptions options;
  options.camera = "127.0.0.1";
  options.profiles = std::string(ORBITFUSE_SOURCE_DIR) + "/config/cameras";
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  const char* wanted = std::getenv("ORBITFUSE_SOAK_S");
  const auto count = static_cast<std::uint64_t>(30 * (wanted ? std::atof(wanted) : 60.0));
  const Tally tally = drain(source, std::chrono::seconds(count / 10), [&](const Tally& t) { return t.frames + t.rejected >= count; });
  EXPECT_EQ(tally.frames, count);
  EXPECT_EQ(tally.span(), count);
  EXPECT_EQ(tally.rejected + tally.wrong_bits + tally.not_rising, 0u);
  std::printf("frames %llu, dropped packets %llu, resent %llu, clock residual %.2f ms, drift %.1f ppm\n",
              static_cast<unsigned long long>(tally.frames), static_cast<unsigned long long>(camera.packets_dropped()),
              static_cast<unsigned long long>(camera.resends_answered()), 1000 * source.clock().residual_rms_s(),
              source.clock().drift_ppm());
}

TEST(AravisSoak, CleanMinute) { soak(0); }
TEST(AravisSoak, OnePercentLossWithResend) { soak(0.01); }

/// Nine frames of ten are damaged: each is counted, and every other is stored.
TEST(AravisSoak, HalfPercentLossWithoutResend) {
  GevSimulator camera;
  bool up = false;
  for (int i = 0; i < 100 && !(up = camera.start()); ++i) usleep(100'000);
  if (!up) GTEST_SKIP() << "the GVCP port 3956 on loopback is in use";
  GevFaults faults;
  faults.packet_loss = 0.005;
  faults.answer_resend = false;
  camera.set_faults(faults);
  AravisOptions options;
  options.camera = "127.0.0.1";
  options.profiles = std::string(ORBITFUSE_SOURCE_DIR) + "/config/cameras";
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  const char* wanted = std::getenv("ORBITFUSE_SOAK_S");
  const auto count = static_cast<std::uint64_t>(30 * (wanted ? std::atof(wanted) : 60.0));
  const Tally tally = drain(source, std::chrono::seconds(count / 10), [&](const Tally& t) { return t.span() >= count; });
  const std::uint64_t sent = camera.frames_sent(), whole = sent - camera.frames_damaged();
  std::printf("span %llu of %llu sent: %llu frames stored of %llu whole ones, %llu rejected, %llu missing\n",
              static_cast<unsigned long long>(tally.span()), static_cast<unsigned long long>(sent),
              static_cast<unsigned long long>(tally.frames), static_cast<unsigned long long>(whole),
              static_cast<unsigned long long>(tally.rejected),
              static_cast<unsigned long long>(tally.span() - tally.frames - tally.rejected));
  EXPECT_EQ(tally.wrong_bits + tally.not_rising, 0u);
  // Frames under way at either end are the difference.
  EXPECT_NEAR(static_cast<double>(tally.span()), static_cast<double>(sent), 20);
  EXPECT_NEAR(static_cast<double>(tally.frames), static_cast<double>(whole), 5);
}

}  // namespace
}  // namespace orbitfuse::aravis
