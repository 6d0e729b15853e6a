// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <poll.h>
#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace orbitfuse::v4l2 {

/// The system calls a V4L2 camera needs, as a seam: tests inject one that misbehaves on script.
/// Each behaves as its namesake: -1 (MAP_FAILED for mmap) and errno on failure.
class VideoSystem {
 public:
  virtual ~VideoSystem() = default;
  virtual int open(const std::string& path, int flags) = 0;
  virtual int close(int fd) = 0;
  virtual int ioctl(int fd, unsigned long request, void* argument) = 0;
  virtual void* mmap(std::size_t length, int fd, off_t offset) = 0;
  virtual int munmap(void* address, std::size_t length) = 0;
  virtual int poll(pollfd* fds, nfds_t count, int timeout_ms) = 0;

  /// What sysfs says of every /dev/video* node.
  struct Node {
    std::string path;      ///< "/dev/video2"; changes when a camera is plugged in again
    std::string serial;    ///< of the USB device, may be empty
    std::string usb_path;  ///< the port, e.g. "1-4.2"; stays when the node changes
    std::string usb_id;    ///< "046d:0825"
    std::string product;
    std::string function;  ///< which of the device's cameras: USB interface and index, "1.0/0"
  };
  virtual std::vector<Node> nodes() = 0;
  /// Of CLOCK_REALTIME or CLOCK_MONOTONIC.
  virtual std::int64_t now_ns(clockid_t clock);
};

/// The kernel's.
std::shared_ptr<VideoSystem> make_video_system();

/// Nodes listed in a sysfs tree (default /sys/class/video4linux); split out for tests.
std::vector<VideoSystem::Node> read_nodes(const std::string& sysfs_class_folder);

}  // namespace orbitfuse::v4l2
