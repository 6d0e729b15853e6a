// SPDX-License-Identifier: BSD-3-Clause
#include "tests/drivers/v4l2/fake_video_system.hpp"

#include <linux/videodev2.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>

namespace orbitfuse::v4l2 {
namespace {

int failure(int error) {
  errno = error;
  return -1;
}

}  // namespace

int FakeVideoSystem::open(const std::string& path, int) {
  const bool other =
      std::any_of(others.begin(), others.end(), [&](const Node& n) { return n.path == path; });
  if (!other && (!plugged || path != camera.path)) return failure(ENOENT);
  if (open_error) return failure(open_error);
  ++open_descriptors;
  last_opened = path;
  return 7;
}

int FakeVideoSystem::close(int) {
  --open_descriptors;
  return 0;
}

std::vector<VideoSystem::Node> FakeVideoSystem::nodes() {
  std::vector<Node> list = others;
  if (plugged) list.push_back(camera);
  return list;
}

std::int64_t FakeVideoSystem::now_ns(clockid_t clock) {
  return VideoSystem::now_ns(clock) + monotonic_step_ns +
         (clock == CLOCK_REALTIME ? wall_step_ns : 0);
}

void* FakeVideoSystem::mmap(std::size_t length, int, off_t offset) {
  ++mapped;
  auto& block = memory_[static_cast<std::uint32_t>(offset)];
  block.assign(length, 0);
  return block.data();
}

int FakeVideoSystem::munmap(void*, std::size_t) {
  --mapped;
  return 0;
}

int FakeVideoSystem::poll(pollfd* fds, nfds_t count, int) {
  ++polls;
  if (count == 0) return 0;
  fds[0].revents = 0;
  if (!plugged) {
    fds[0].revents = POLLERR | POLLHUP;
    return 1;
  }
  if (shots.empty()) return 0;
  fds[0].revents = POLLIN;
  return 1;
}

int FakeVideoSystem::dequeue(void* argument) {
  if (dequeue_error) return failure(dequeue_error);
  if (shots.empty() || queued_.empty()) return failure(EAGAIN);
  const Shot shot = shots.front();
  shots.pop_front();
  auto* buffer = static_cast<v4l2_buffer*>(argument);
  buffer->index = queued_.front();
  queued_.pop_front();
  std::copy(shot.bytes.begin(), shot.bytes.end(), memory_[buffer->index].begin());
  buffer->bytesused =
      shot.claimed_bytes ? shot.claimed_bytes : static_cast<std::uint32_t>(shot.bytes.size());
  buffer->sequence = shot.sequence;
  buffer->flags = shot.flags;
  buffer->timestamp.tv_sec = shot.stamp_us / 1'000'000;
  buffer->timestamp.tv_usec = shot.stamp_us % 1'000'000;
  return 0;
}

int FakeVideoSystem::control(unsigned long request, void* argument) {
  auto* value = static_cast<v4l2_control*>(argument);
  const auto entry = controls.find(value->id);
  if (entry == controls.end()) return failure(EINVAL);
  if (request == VIDIOC_G_CTRL) {
    value->value = entry->second;
  } else if (exposure_sticks || value->id != V4L2_CID_EXPOSURE_ABSOLUTE) {
    entry->second = value->value;
  }
  return 0;
}

int FakeVideoSystem::ioctl(int, unsigned long request, void* argument) {
  if (!plugged) return failure(ENODEV);
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto* capability = static_cast<v4l2_capability*>(argument);
      capability->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      return 0;
    }
    case VIDIOC_ENUM_FMT: {
      auto* entry = static_cast<v4l2_fmtdesc*>(argument);
      if (entry->index > 0) return failure(EINVAL);
      entry->pixelformat = fourcc;
      return 0;
    }
    case VIDIOC_G_FMT:
      return 0;
    case VIDIOC_S_FMT: {
      auto& pixels = static_cast<v4l2_format*>(argument)->fmt.pix;
      asked_width = static_cast<int>(pixels.width);
      asked_height = static_cast<int>(pixels.height);
      pixels.width = static_cast<std::uint32_t>(width);
      pixels.height = static_cast<std::uint32_t>(height);
      pixels.bytesperline = 0;
      return 0;
    }
    case VIDIOC_S_PARM:
      return 0;
    case VIDIOC_REQBUFS:
      queued_.clear();
      return 0;
    case VIDIOC_QUERYBUF: {
      auto* buffer = static_cast<v4l2_buffer*>(argument);
      buffer->length = buffer_length;
      buffer->m.offset = buffer->index;
      return 0;
    }
    case VIDIOC_QBUF:
      queued_.push_back(static_cast<v4l2_buffer*>(argument)->index);
      return 0;
    case VIDIOC_DQBUF:
      return dequeue(argument);
    case VIDIOC_STREAMON:
      if (stream_on_error) return failure(stream_on_error);
      ++streams_started;
      return 0;
    case VIDIOC_STREAMOFF:
      return 0;
    case VIDIOC_G_CTRL:
    case VIDIOC_S_CTRL:
      return control(request, argument);
    default:
      return failure(ENOTTY);
  }
}

}  // namespace orbitfuse::v4l2
