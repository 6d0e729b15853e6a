// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/v4l2/v4l2_source.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <cstring>
#include <ctime>

namespace orbitfuse::v4l2 {

V4l2Source::V4l2Source(V4l2Options options, std::shared_ptr<VideoSystem> system)
    : options_(std::move(options)),
      system_(std::move(system)),
      temperatures_(ThermalSamples::linear(options_.kelvin_per_dn)),
      freeze_(options_.nuc_settle) {}

V4l2Source::~V4l2Source() { stop(); }

DeviceInfo V4l2Source::describe() const {
  DeviceInfo info;
  info.id = options_.device_id;
  info.modality = options_.modality;
  info.driver = "v4l2";
  const std::lock_guard lock(node_mutex_);
  info.model = node_.product;
  info.serial = node_.serial;
  return info;
}

int V4l2Source::ioctl(unsigned long request, void* argument) {
  int result = 0;
  do {
    result = system_->ioctl(fd_, request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

Status V4l2Source::start() {
  ORBITFUSE_TRY(options_.validate());
  ORBITFUSE_ASSIGN(const VideoSystem::Node node,
                   find_camera(*system_, *parse_camera_name(options_.camera)));
  ORBITFUSE_TRY(open_and_stream(node));
  // From here on it is this camera, wherever it is plugged in.
  identity_ = identity_of(*system_, node);
  first_layout_ = layout_;
  moved_ = look_alike_told_ = false;
  return {};
}

void V4l2Source::stop() {
  close_device();
  away_ = false;
}

Delivery V4l2Source::lose(EventKind kind, const std::string& why) {
  close_device();
  // Nobody plugs a camera in again within half a second: one like it elsewhere is its twin.
  using namespace std::chrono_literals;
  if (identity_ && Clock::now() - last_frame_ < 500ms &&
      look_alike(*system_, *identity_, node_.usb_path))
    identity_->port_only = true;
  look_alike_told_ = false;
  away_ = true;
  rhythm_.interrupt();
  lost_at_ = last_frame_;  // set on reopening too: an earlier outage is counted already
  last_attempt_ = {};
  return event_delivery(kind, why);
}

Delivery V4l2Source::stall(const std::string& why) {
  Delivery event = lose(EventKind::stalled, why + "; reopening it");
  if (++stalls_in_a_row_ < 2 || !options_.reset_port || node_.usb_path.empty()) return event;
  const Status reset = options_.reset_port(node_.usb_path);
  event.detail = why + " again; " + (reset ? "its USB port was reset" : reset.error().message());
  return event;
}

std::optional<Delivery> V4l2Source::try_reopen() {
  if (Clock::now() - last_attempt_ < options_.reopen_every) return std::nullopt;
  last_attempt_ = Clock::now();
  // Away or refused: tried again, for as long as the user waits.
  const Result<VideoSystem::Node> node = find_again(*system_, *identity_);
  if (!node) return tell_look_alike();
  if (const Status status = open_and_stream(*node); !status) {
    if (!failure_.note(status.error().message())) return std::nullopt;
    return event_delivery(EventKind::reopen_failed, status.error().message());
  }
  failure_.clear();
  away_ = false;
  const double outage_s = std::chrono::duration<double>(Clock::now() - lost_at_).count();
  // Ids leave room for what the outage cost, so that it counts as lost.
  const std::uint64_t cost = rhythm_.frames_in(outage_s);
  next_id_ = base_id_ += cost;  // also if it is lost again before a frame
  Delivery delivery =
      event_delivery(EventKind::reconnected,
                     fmt::format("{} after {:.1f} s, about {} frames", node_.path, outage_s, cost));
  moved_ = node_.usb_path != identity_->node.usb_path;
  ports_looked_at_ = Clock::now();
  if (moved_) {
    tell(EventKind::moved,
         fmt::format(
             "the camera of serial {} is at usb:{} now, it was at usb:{}; if this is another "
             "camera of that serial, stop and put the first one back",
             node_.serial, node_.usb_path, identity_->node.usb_path));
  } else if (identity_->port_only && !node_.usb_path.empty()) {
    delivery.detail += fmt::format("; known by its port usb:{} alone", node_.usb_path);
  }
  return delivery;
}

/// While the camera is away and one like it is elsewhere: once in an outage.
std::optional<Delivery> V4l2Source::tell_look_alike() {
  if (look_alike_told_ || !identity_->port_only) return std::nullopt;
  const auto other = look_alike(*system_, *identity_);
  if (!other) return std::nullopt;
  look_alike_told_ = true;
  return event_delivery(EventKind::look_alike,
                        fmt::format("a camera like it is at usb:{} and is not taken for it; plug "
                                    "the session's into usb:{} again",
                                    other->usb_path, identity_->node.usb_path));
}

/// While a camera in another port is taken for it.
bool V4l2Source::original_is_back() {
  using namespace std::chrono_literals;
  if (!moved_ || Clock::now() - ports_looked_at_ < std::min<Clock::duration>(options_.stall, 1s))
    return false;
  ports_looked_at_ = Clock::now();
  const Result<VideoSystem::Node> found = find_again(*system_, *identity_);
  return found && found->usb_path == identity_->node.usb_path;
}

Result<Delivery> V4l2Source::next(std::chrono::milliseconds timeout) {
  if (!pending_.empty()) {
    Delivery event = std::move(pending_.front());
    pending_.erase(pending_.begin());
    return event;
  }
  if (away_) {
    if (std::optional<Delivery> back = try_reopen()) return std::move(*back);
    const auto pause = std::min(timeout, options_.reopen_every);
    system_->poll(nullptr, 0, static_cast<int>(pause.count()));
    return Delivery{};
  }
  if (fd_ < 0) return fail(ErrorKind::device, options_.camera, "not started", "call start() first");
  if (original_is_back()) {
    identity_->port_only = true;
    return lose(EventKind::twin,
                fmt::format("there are two cameras of serial {}; going back to the one at "
                            "usb:{}; frames flagged other-port are the other's",
                            identity_->node.serial, identity_->node.usb_path));
  }
  pollfd waiter{fd_, POLLIN, 0};
  const int ready = system_->poll(&waiter, 1, static_cast<int>(timeout.count()));
  if (ready < 0 && errno != EINTR) return lose(EventKind::disconnected, std::strerror(errno));
  if (ready > 0 && (waiter.revents & POLLIN)) return dequeue();
  if (ready > 0) return lose(EventKind::disconnected, "the device reports an error");
  if (Clock::now() - last_frame_ > options_.stall) return stall("no frame");
  return Delivery{};
}

Result<Delivery> V4l2Source::dequeue() {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (ioctl(VIDIOC_DQBUF, &buffer) < 0) {
    if (errno == EAGAIN) return Delivery{};
    // A stream that breaks before its first frame would break again after mere reopening.
    if (errno == EIO && !last_sequence_) return stall("the stream broke before its first frame");
    return lose(EventKind::disconnected,
                std::strerror(errno));  // ENODEV: unplugged; EIO: the stream broke
  }
  if (buffer.index >= buffers_.size())
    return lose(EventKind::disconnected, "the driver answers nonsense");
  // When a transfer fails uvcvideo hands every buffer back empty, with the number of an old frame.
  const bool old =
      last_sequence_ && static_cast<std::int32_t>(buffer.sequence - *last_sequence_) <= 0;
  if ((buffer.flags & V4L2_BUF_FLAG_ERROR) && buffer.bytesused == 0) {
    if (old)
      return lose(EventKind::disconnected,
                  "a transfer failed: the driver gave its buffers back empty");
    if (!last_sequence_) return empty_at_start(buffer);
  }
  last_frame_ = Clock::now();
  stalls_in_a_row_ = 0;
  const std::uint64_t id = unwrap(buffer.sequence);
  const std::int64_t stamp_ns = std::int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 +
                                std::int64_t{buffer.timestamp.tv_usec} * 1000;
  // Frames that waited for us come in a burst: how long a picture stands is told by their stamps.
  const FreezeWatch::Clock::time_point taken_at{
      std::chrono::nanoseconds(stamp_ns > 0 ? stamp_ns : system_->now_ns(CLOCK_MONOTONIC))};
  Delivery delivery = delivery_of(buffer.index, buffer.bytesused, buffer.flags, taken_at);
  delivery.frame.id = id;
  if (stamp_ns != 0) delivery.frame.device_time_ns = stamp_ns;
  const std::int64_t monotonic_ns = system_->now_ns(CLOCK_MONOTONIC);
  std::int64_t arrival_ns = system_->now_ns(CLOCK_REALTIME);
  const bool monotonic =
      (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  // The kernel's stamp leaves out our own scheduling delay.
  if (monotonic && stamp_ns > 0) arrival_ns -= monotonic_ns - stamp_ns;
  // The wall clock may be set while recording; times in a session rise all the same.
  const ClockMap::Stamp stamp = clock_.add(stamp_ns, arrival_ns);
  delivery.frame.host_time_ns = stamp.host_time_ns;
  if (stamp.event) tell(EventKind::clock, *stamp.event);
  watch_rhythm(id, stamp_ns > 0 ? stamp_ns : monotonic_ns);
  if (adapting_ && delivery.kind == Delivery::Kind::frame) {
    if (!adapting_since_ns_) adapting_since_ns_ = monotonic_ns;
    if (monotonic_ns - *adapting_since_ns_ >= std::chrono::nanoseconds(options_.adapt).count())
      lock_adapted();
  }
  if (ioctl(VIDIOC_QBUF, &buffer) < 0)
    pending_.push_back(lose(EventKind::disconnected, std::strerror(errno)));
  return delivery;
}

/// Some drivers flush empty buffers when a stream starts: a few are nothing, more are a camera that
/// hangs.
Result<Delivery> V4l2Source::empty_at_start(v4l2_buffer& buffer) {
  if (++empty_at_start_ > options_.buffers) return stall("only empty buffers");
  if (ioctl(VIDIOC_QBUF, &buffer) < 0) return lose(EventKind::disconnected, std::strerror(errno));
  return Delivery{};
}

void V4l2Source::watch_rhythm(std::uint64_t id, std::int64_t stamp_ns) {
  const int missing = rhythm_.note(id, stamp_ns);
  if (missing == 0) return;
  late_frames_ += missing;
  // A camera of unsteady rate (phones) would fill the manifest.
  if (Clock::now() - last_late_event_ < std::chrono::seconds(10)) return;
  last_late_event_ = Clock::now();
  tell(
      EventKind::late_frame,
      fmt::format("frame {} is late by {} though none is missing in the driver's count; {} so far: "
                  "lost whole on USB, or the camera slowed down",
                  id, missing, late_frames_));
}

void V4l2Source::tell(EventKind kind, std::string detail) {
  pending_.push_back(event_delivery(kind, std::move(detail)));
}

/// A camera that died and stayed away: what fits into the time since its last frame is lost.
std::vector<Delivery> V4l2Source::unfinished() {
  const double quiet_s = std::chrono::duration<double>(Clock::now() - last_frame_).count();
  const bool gone = away_ || (fd_ >= 0 && Clock::now() - last_frame_ > options_.stall / 2);
  const double since_s =
      away_ ? std::chrono::duration<double>(Clock::now() - lost_at_).count() : quiet_s;
  if (!gone || !rhythm_.known()) return {};
  Delivery lost;
  lost.kind = Delivery::Kind::lost;
  lost.frame.id = next_id_ + rhythm_.frames_in(since_s) - 1;
  lost.reason = fmt::format("no frame for the last {:.1f} s, counted by time", since_s);
  return {lost};
}

Delivery V4l2Source::delivery_of(std::uint32_t index, std::uint32_t bytes, std::uint32_t flags,
                                 FreezeWatch::Clock::time_point taken_at) {
  Delivery delivery;
  delivery.kind = Delivery::Kind::rejected;
  if (flags & V4L2_BUF_FLAG_ERROR) {
    delivery.reason = "the driver flags it as damaged";
    return delivery;
  }
  const Mapping& mapping = buffers_[index];
  if (bytes > mapping.length) {
    delivery.reason = fmt::format("{} bytes in a buffer of {}", bytes, mapping.length);
    return delivery;
  }
  const Status status =
      unpack({static_cast<const std::uint8_t*>(mapping.address), bytes}, layout_, delivery.frame);
  if (!status) {
    delivery.reason = status.error().found;
    return delivery;
  }
  delivery.kind = Delivery::Kind::frame;
  if (moved_) delivery.frame.flag(FrameFlag::other_port);
  if (options_.modality == Modality::thermal &&
      freeze_.mark(delivery.frame, mapping.address, bytes, taken_at)) {
    tell(EventKind::nuc, "the image is frozen");
  }
  const bool counts = layout_.fourcc == V4L2_PIX_FMT_Y16;
  delivery.frame.thermal_is_gray = options_.modality == Modality::thermal && !counts;
  if (counts && options_.kelvin_per_dn > 0) {
    if (const auto clipped = temperatures_.apply(
            delivery.frame, 0xffff,
            "set a hotter range in the camera, and kelvin-per-dn to that range's kelvin a count"))
      tell(EventKind::clipped, *clipped);
  } else if (counts) {
    if (const auto stretch = raw_counts_.apply(delivery.frame))
      tell(EventKind::raw_counts, *stretch);
  }
  return delivery;
}

/// The driver counts in 32 bits and starts again at 0 after reopening; ids must rise strictly.
std::uint64_t V4l2Source::unwrap(std::uint32_t sequence) {
  if (!last_sequence_) {
    last_sequence_ = sequence;
    next_id_ = base_id_ + 1;
    return base_id_;
  }
  // Some drivers repeat a number after an error; that is one more frame, not 2^32 lost ones.
  const std::uint32_t step = sequence - *last_sequence_;
  const std::uint64_t advance = step == 0 || step > 0x80000000u ? 1 : step;
  last_sequence_ = sequence;
  const std::uint64_t id = next_id_ - 1 + advance;
  next_id_ = id + 1;
  return id;
}

}  // namespace orbitfuse::v4l2
