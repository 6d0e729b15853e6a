// SPDX-License-Identifier: BSD-3-Clause
// From a camera's name to a running stream: format, rate, buffers.
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <sys/mman.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#include "drivers/v4l2/v4l2_source.hpp"

#include "core/option_range.hpp"

namespace orbitfuse::v4l2 {
namespace {

tl::unexpected<Error> device_error(const std::string& where, const std::string& what, int error) {
  std::string remedy = "unplug it and plug it in again";
  if (error == EBUSY) remedy = "close the other program that uses it (fuser -v " + where + ")";
  if (error == EACCES || error == EPERM)
    remedy = "add yourself to the group video and log in again";
  if (error == ENOENT || error == ENODEV)
    remedy = "plug it in, or name another (orbitfuse devices)";
  if (error == ENOSPC) {
    remedy = "USB bandwidth is used up: lower the size or rate, use MJPG, or another USB port";
  }
  return fail(ErrorKind::device, where, what + ": " + std::strerror(error), std::move(remedy));
}

std::uint32_t fourcc_of(std::string text) {
  text.resize(4, ' ');
  return v4l2_fourcc(static_cast<unsigned char>(text[0]), static_cast<unsigned char>(text[1]),
                     static_cast<unsigned char>(text[2]), static_cast<unsigned char>(text[3]));
}

}  // namespace

Status V4l2Options::validate() const {
  ORBITFUSE_TRY(parse_camera_name(camera));
  if (width < 0 || height < 0 || (width == 0) != (height == 0))
    return fail(ErrorKind::usage, "v4l2.width", fmt::format("{}x{}", width, height),
                "give both or neither");
  if (!format.empty() && !is_supported(fourcc_of(format)))
    return fail(ErrorKind::usage, "v4l2.format", format, "one of MJPG, YUYV, NV12, GREY, Y16");
  const OptionCheck check("v4l2");
  ORBITFUSE_TRY(check("rate_hz", rate_hz, at_least(0)));
  ORBITFUSE_TRY(check("buffers", buffers, at_least(2)));
  ORBITFUSE_TRY(check("kelvin_per_dn", kelvin_per_dn, from_to(0, max_kelvin_per_sample)));
  const auto ms = [](auto time) { return std::chrono::duration<double, std::milli>(time).count(); };
  ORBITFUSE_TRY(check("stall", ms(stall), above(0)));
  ORBITFUSE_TRY(check("reopen_every", ms(reopen_every), above(0)));
  return check("nuc_settle", ms(nuc_settle), at_least(0));
}

Status V4l2Source::open_and_stream(const VideoSystem::Node& node) {
  {
    const std::lock_guard lock(node_mutex_);
    node_ = node;
  }
  // Non-blocking: a blocking DQBUF can hang for ever when the camera is unplugged.
  fd_ = system_->open(node_.path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0) return device_error(node_.path, "cannot be opened", errno);
  const auto prepare = [this]() -> Status {
    ORBITFUSE_TRY(choose_format());
    ORBITFUSE_TRY(set_rate());
    ORBITFUSE_TRY(apply_controls());
    ORBITFUSE_TRY(map_buffers());
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (ioctl(VIDIOC_STREAMON, &type) < 0)
      return device_error(node_.path, "streaming did not start", errno);
    return {};
  };
  const std::size_t told = pending_.size();
  if (Status status = prepare(); !status) {
    close_device();
    pending_.resize(told);  // what an attempt that failed had to tell comes again with the next
    return status;
  }
  last_frame_ = Clock::now();
  last_sequence_.reset();
  empty_at_start_ = 0;
  base_id_ = next_id_;
  return {};
}

Status V4l2Source::choose_format() {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (ioctl(VIDIOC_G_FMT, &format) < 0) return device_error(node_.path, "has no format", errno);
  std::vector<std::string> order{"MJPG", "YUYV", "NV12", "GREY", "Y16 "};
  if (options_.modality == Modality::thermal) order = {"Y16 ", "GREY", "YUYV", "MJPG", "NV12"};
  if (!options_.format.empty()) order = {options_.format};
  int width = options_.width, height = options_.height;
  if (first_layout_) {
    order = {fourcc_text(first_layout_->fourcc)};
    width = first_layout_->width;
    height = first_layout_->height;
  }
  std::vector<std::uint32_t> offered;
  for (v4l2_fmtdesc entry{.index = 0,
                    .type = V4L2_BUF_TYPE_VIDEO_CAPTURE,
                    .flags = 0,
                    .description = {},
                    .pixelformat = 0,
                    .mbus_code = 0,
                    .reserved = {}};
       ioctl(VIDIOC_ENUM_FMT, &entry) == 0; ++entry.index) {
    offered.push_back(entry.pixelformat);
  }
  std::uint32_t chosen = 0;
  for (const std::string& candidate : order) {
    for (std::uint32_t fourcc : offered) {
      if (chosen == 0 && fourcc == fourcc_of(candidate)) chosen = fourcc;
    }
  }
  if (chosen == 0) {
    std::string list;
    for (std::uint32_t fourcc : offered) list += " " + fourcc_text(fourcc);
    return fail(ErrorKind::device, node_.path, "offers only" + list,
                "choose a camera or a format that is supported (MJPG, YUYV, NV12, GREY, Y16)");
  }
  format.fmt.pix.pixelformat = chosen;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (width > 0) {
    format.fmt.pix.width = static_cast<std::uint32_t>(width);
    format.fmt.pix.height = static_cast<std::uint32_t>(height);
  }
  if (ioctl(VIDIOC_S_FMT, &format) < 0)
    return device_error(node_.path, "refuses the format", errno);
  const v4l2_pix_format& got = format.fmt.pix;
  // Drivers answer with the nearest size they have; a session must not change size silently.
  if (got.width == 0 || got.height == 0)
    return fail(ErrorKind::device, node_.path, "has images of 0 pixels",
                "name a size (size=1280x720; v4l2-ctl --list-formats-ext)");
  if (got.pixelformat != chosen || (width > 0 && (static_cast<int>(got.width) != width ||
                                                  static_cast<int>(got.height) != height))) {
    return fail(ErrorKind::device, node_.path,
                fmt::format("gives {} {}x{}, asked for {} {}x{}", fourcc_text(got.pixelformat),
                            got.width, got.height, fourcc_text(chosen), width, height),
                "choose a size that the camera has (v4l2-ctl --list-formats-ext)");
  }
  layout_ = Layout{got.pixelformat, static_cast<int>(got.width), static_cast<int>(got.height),
                   static_cast<int>(got.bytesperline)};
  return {};
}

Status V4l2Source::set_rate() {
  if (options_.rate_hz <= 0) return {};
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  parameters.parm.capture.timeperframe.numerator = 1000;
  parameters.parm.capture.timeperframe.denominator =
      static_cast<std::uint32_t>(std::lround(1000 * options_.rate_hz));
  if (ioctl(VIDIOC_S_PARM, &parameters) < 0 && errno != ENOTTY && errno != EINVAL) {
    return device_error(node_.path, "refuses the frame rate", errno);
  }
  return {};
}

Status V4l2Source::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = static_cast<std::uint32_t>(options_.buffers);
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (ioctl(VIDIOC_REQBUFS, &request) < 0 || request.count < 2) {
    return device_error(node_.path, "gives no buffers", request.count < 2 ? ENOMEM : errno);
  }
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer{};
    buffer.index = i;
    buffer.type = request.type;
    buffer.memory = request.memory;
    if (ioctl(VIDIOC_QUERYBUF, &buffer) < 0)
      return device_error(node_.path, "buffer query failed", errno);
    void* address = system_->mmap(buffer.length, fd_, buffer.m.offset);
    if (address == MAP_FAILED) return device_error(node_.path, "buffer mapping failed", errno);
    buffers_.push_back({address, buffer.length});
    if (ioctl(VIDIOC_QBUF, &buffer) < 0)
      return device_error(node_.path, "buffer not accepted", errno);
  }
  return {};
}

void V4l2Source::close_device() {
  if (fd_ < 0) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  ioctl(VIDIOC_STREAMOFF, &type);
  for (const Mapping& buffer : buffers_) system_->munmap(buffer.address, buffer.length);
  buffers_.clear();
  system_->close(fd_);
  fd_ = -1;
}

}  // namespace orbitfuse::v4l2
