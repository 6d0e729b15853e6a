// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <random>

#include "tests/drivers/v4l2/fake_video_system.hpp"

namespace orbitfuse::bench {

/// A UVC camera of 8x4 gray pixels at 30 Hz that goes wrong at random: frames flagged as damaged or
/// too short, holes in the driver's count, stalls, and unplugging under another node each time.
class PacedVideo final : public v4l2::FakeVideoSystem {
 public:
  explicit PacedVideo(std::uint32_t seed);

  int poll(pollfd* fds, nfds_t count, int timeout_ms) override;
  std::vector<Node> nodes() override;
  int ioctl(int fd, unsigned long request, void* argument) override;

 private:
  using Clock = std::chrono::steady_clock;
  void go_on();
  double chance() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  std::mt19937 random_;
  std::uint32_t sequence_ = 0;
  int node_ = 0;
  Clock::time_point next_frame_ = Clock::now(), back_at_{}, next_fault_ = Clock::now();
  bool stalled_ = false;
};

}  // namespace orbitfuse::bench
