// SPDX-License-Identifier: BSD-3-Clause
#include "bench/capture/paced_video.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <thread>

namespace orbitfuse::bench {

using namespace std::chrono_literals;

PacedVideo::PacedVideo(std::uint32_t seed) : random_(seed) {
  fourcc = V4L2_PIX_FMT_GREY;
  next_fault_ = Clock::now() + 3s;
}

/// Up to now: the camera may be plugged in again, goes wrong, sends what is due.
void PacedVideo::go_on() {
  constexpr auto period = 33ms;
  const auto now = Clock::now();
  if (now >= back_at_ && (!plugged || stalled_)) {
    if (!plugged) {
      camera.path = fmt::format("/dev/video{}", ++node_);
      sequence_ = 0;
      shots.clear();
    }
    plugged = true;
    stalled_ = false;
    next_frame_ = now;
  }
  if (now >= next_fault_) {
    next_fault_ = now + std::chrono::milliseconds(2000 + static_cast<int>(6000 * chance()));
    back_at_ = now + std::chrono::milliseconds(300 + static_cast<int>(3000 * chance()));
    (chance() < 0.6 ? plugged : stalled_) ^= true;
  }
  if (!plugged || stalled_) return;
  while (next_frame_ <= now && shots.size() < 4) {
    next_frame_ += period;
    sequence_ += chance() < 0.02 ? 3 : 1;
    Shot shot;
    shot.sequence = sequence_;
    shot.bytes.assign(chance() < 0.02 ? 16 : 32, static_cast<std::uint8_t>(sequence_ * 7 + 40));
    if (chance() < 0.02) shot.flags = V4L2_BUF_FLAG_ERROR;
    shots.push_back(std::move(shot));
  }
  next_frame_ = std::max(next_frame_, now - period);
}

int PacedVideo::poll(pollfd* fds, nfds_t count, int timeout_ms) {
  const auto until = Clock::now() + std::chrono::milliseconds(timeout_ms);
  while (true) {
    go_on();
    const int ready = FakeVideoSystem::poll(fds, count, 0);
    if (ready != 0 || Clock::now() >= until) return ready;
    std::this_thread::sleep_for(3ms);
  }
}

std::vector<v4l2::VideoSystem::Node> PacedVideo::nodes() {
  go_on();
  return FakeVideoSystem::nodes();
}

int PacedVideo::ioctl(int fd, unsigned long request, void* argument) {
  if (request == VIDIOC_STREAMON) sequence_ = 0;
  return FakeVideoSystem::ioctl(fd, request, argument);
}

}  // namespace orbitfuse::bench
