// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "drivers/v4l2/video_system.hpp"

namespace orbitfuse::v4l2 {

/// A scripted kernel with one camera: frames are queued with their flags and sequence numbers;
/// unplugging makes every call fail with ENODEV until plug() puts the camera under another node.
class FakeVideoSystem : public VideoSystem {
 public:
  struct Shot {
    std::uint32_t sequence = 0, flags = 0;
    std::vector<std::uint8_t> bytes;
    std::uint32_t claimed_bytes = 0;  ///< 0: bytes.size()
    std::int64_t stamp_us = 0;        ///< of the driver; 0: none
  };

  Node camera{"/dev/video0", "SN42", "1-4", "046d:0825", "Fake Camera", "1.0/0"};
  std::vector<Node> others;  ///< plugged in all the time, listed before the camera
  std::uint32_t fourcc = 0;
  int width = 8, height = 4;
  bool plugged = true;
  int open_error = 0, stream_on_error = 0, dequeue_error = 0;
  bool exposure_sticks = true;
  int asked_width = 0, asked_height = 0;
  std::int64_t wall_step_ns = 0, monotonic_step_ns = 0;  ///< added to the clocks
  std::deque<Shot> shots;
  std::map<std::uint32_t, int> controls;

  std::string last_opened;
  int open_descriptors = 0, mapped = 0, streams_started = 0, polls = 0;
  static constexpr std::size_t buffer_length = 4096;

  int open(const std::string& path, int flags) override;
  int close(int fd) override;
  int ioctl(int fd, unsigned long request, void* argument) override;
  void* mmap(std::size_t length, int fd, off_t offset) override;
  int munmap(void* address, std::size_t length) override;
  int poll(pollfd* fds, nfds_t count, int timeout_ms) override;
  std::vector<Node> nodes() override;
  std::int64_t now_ns(clockid_t clock) override;

 private:
  int dequeue(void* argument);
  int control(unsigned long request, void* argument);
  std::map<std::uint32_t, std::vector<std::uint8_t>> memory_;
  std::deque<std::uint32_t> queued_;
};

}  // namespace orbitfuse::v4l2
