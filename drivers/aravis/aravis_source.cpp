// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/aravis_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <utility>

#include "drivers/aravis/link.hpp"
#include "drivers/aravis/teardown.hpp"

namespace orbitfuse::aravis {
namespace {

std::int64_t wall_ns() {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

/// When its first packet came, as Aravis' thread saw it: nothing of waiting for resent packets, of
/// the queue or of a busy host is in it.
std::int64_t arrival_of(ArvBuffer* buffer) {
  const std::int64_t now_ns = wall_ns();
  const auto first_ns = static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer));
  return first_ns > 0 && first_ns <= now_ns && now_ns - first_ns < 5'000'000'000 ? first_ns
                                                                                 : now_ns;
}

}  // namespace

Status AravisOptions::validate() const {
  if (buffers < 2)
    return fail(ErrorKind::usage, "aravis.buffers", fmt::format("{}", buffers), "must be >= 2");
  if (silence.count() <= 0 || give_up < silence) {
    return fail(ErrorKind::usage, "aravis.give_up", fmt::format("{} ms", give_up.count()),
                "must be > 0 and >= silence");
  }
  if (nuc_settle.count() < 0)
    return fail(ErrorKind::usage, "aravis.nuc_settle", "negative", "must be >= 0");
  if (patience.count() <= 0 || most_patience < patience) {
    return fail(ErrorKind::usage, "aravis.patience", fmt::format("{} ms", patience.count()),
                "must be > 0 and <= most_patience");
  }
  return {};
}

AravisSource::AravisSource(AravisOptions options)
    : options_(std::move(options)), freeze_(options_.nuc_settle) {
  info_.id = options_.device_id;
  info_.modality = options_.modality;
  info_.driver = "aravis";
}

AravisSource::~AravisSource() { stop(); }

DeviceInfo AravisSource::describe() const {
  const std::lock_guard lock(info_mutex_);
  return info_;
}

Status AravisSource::start() {
  ORBITFUSE_TRY(options_.validate());
  return open();
}

void AravisSource::stop() {
  bury_link();
  // A camera that answers takes milliseconds; nobody waits long for one that is gone, nor twice.
  if (std::exchange(going_, false)) Teardowns::all().wait(address_, std::chrono::seconds(1));
  state_ = State::streaming;
}

Result<Delivery> AravisSource::next(std::chrono::milliseconds timeout) {
  if (!pending_.empty()) {
    Delivery delivery = std::move(pending_.front());
    pending_.erase(pending_.begin());
    return delivery;
  }
  if (state_ == State::away) {
    if (std::optional<Delivery> failed = try_reopen()) return std::move(*failed);
    if (state_ == State::away)
      std::this_thread::sleep_for(std::min(timeout, std::chrono::milliseconds(100)));
    return Delivery{};
  }
  if (!link_)
    return fail(ErrorKind::device, "camera " + options_.camera, "not started",
                "call start() first");
  if (link_->control_lost) return lose("control lost");
  if (correction_wanted_.exchange(false)) return correct_as_asked();
  if (control_mute_ != mute_told_) {
    mute_told_ = control_mute_;
    return event_delivery(mute_told_ ? EventKind::control_silent : EventKind::control_back,
                          address_);
  }
  const auto wait = std::min(timeout, options_.silence / 2);
  ArvBuffer* buffer = arv_stream_timeout_pop_buffer(
      link_->stream,
      static_cast<guint64>(std::chrono::duration_cast<std::chrono::microseconds>(wait).count()));
  return buffer ? take(buffer) : on_silence();
}

Delivery AravisSource::on_silence() {
  const auto quiet = Clock::now() - last_frame_;
  if (quiet > options_.give_up)
    return lose(fmt::format("no frame for {} ms; reopening it", options_.give_up.count()));
  if (quiet <= options_.silence || silent_told_ || state_ == State::proving) return {};
  silent_told_ = true;
  return event_delivery(EventKind::silent,
                        fmt::format("no frame for {} ms", options_.silence.count()));
}

Delivery AravisSource::take(void* handle) {
  auto* buffer = static_cast<ArvBuffer*>(handle);
  last_frame_ = Clock::now();  // damaged or not: the stream lives
  silent_told_ = false;
  const std::int64_t utc_ns = arrival_of(buffer);
  const Arrival arrival{utc_ns, Clock::now() - std::chrono::nanoseconds(wall_ns() - utc_ns)};
  Delivery delivery =
      state_ == State::proving ? come_back(buffer, arrival) : inspect(buffer, arrival);
  arv_stream_push_buffer(link_->stream, buffer);
  // Late packets make one such frame; a camera that counts from 1 again makes nothing else.
  if (duplicates_in_a_row_ >= 3) return lose("the camera's frame numbers restarted; reopening it");
  return delivery;
}

/// Why Aravis' buffer is no frame of this stream, if it is none.
std::optional<std::string> AravisSource::damage(void* handle) {
  auto* buffer = static_cast<ArvBuffer*>(handle);
  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  const guint64 mismatches =
      arv_stream_get_info_uint64_by_name(link_->stream, "n_size_mismatch_errors");
  const bool mismatch = mismatches != mismatches_;
  mismatches_ = mismatches;
  if (status != ARV_BUFFER_STATUS_SUCCESS) {
    const bool packets =
        status == ARV_BUFFER_STATUS_MISSING_PACKETS || status == ARV_BUFFER_STATUS_TIMEOUT;
    return (packets ? "packets are missing"
                    : fmt::format("Aravis status {}", static_cast<int>(status))) +
           (mismatch ? ", larger than announced" : "");
  }
  const int width = arv_buffer_get_image_width(buffer),
            height = arv_buffer_get_image_height(buffer);
  if (mismatch || width != link_->width || height != link_->height)
    return fmt::format("{}x{} where {}x{} is set", width, height, link_->width, link_->height);
  const ArvPixelFormat pixel_format = arv_buffer_get_image_pixel_format(buffer);
  if (pixel_format != link_->pixel_format)
    return fmt::format("pixel format {:#x} where {:#x} is set", pixel_format, link_->pixel_format);
  std::size_t size = 0;
  arv_buffer_get_data(buffer, &size);
  const std::size_t needed = link_->image_bytes();
  if (size < needed) return fmt::format("{} bytes where {} are needed", size, needed);
  return std::nullopt;
}

Delivery AravisSource::inspect(void* handle, const Arrival& arrival) {
  auto* buffer = static_cast<ArvBuffer*>(handle);
  const auto number = static_cast<std::uint16_t>(arv_buffer_get_frame_id(buffer));
  const std::optional<std::uint64_t> count = counter_.unwrap(number);
  if (!count) {
    // A frame number that was counted already: late packets of a frame that was given up.
    ++duplicates_in_a_row_;
    return event_delivery(EventKind::repeated_id, fmt::format("frame id {} again", number));
  }
  duplicates_in_a_row_ = 0;
  Delivery delivery;
  delivery.frame.id = base_id_ + *count;
  next_id_ = delivery.frame.id + 1;
  last_number_ = number;
  last_came_ = arrival.at;
  rhythm_.note(
      delivery.frame.id,
      std::chrono::duration_cast<std::chrono::nanoseconds>(arrival.at.time_since_epoch()).count());
  delivery.kind = Delivery::Kind::rejected;
  if (const std::optional<std::string> found = damage(buffer)) {
    delivery.reason = *found;
    return delivery;
  }

  const Format format = *format_of(link_->pixel_format);
  const std::size_t needed = link_->image_bytes();
  const void* data = arv_buffer_get_data(buffer, nullptr);

  delivery.kind = Delivery::Kind::frame;
  Frame& frame = delivery.frame;
  if (const auto stamp_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer)))
    frame.device_time_ns = stamp_ns;
  const ClockMap::Stamp stamp = clock_.add(frame.device_time_ns, arrival.utc_ns);
  frame.host_time_ns = stamp.host_time_ns;
  if (stamp.event) pending_.push_back(event_delivery(EventKind::clock, *stamp.event));
  cv::Mat(link_->height, link_->width, format.cv_type, const_cast<void*>(data))
      .copyTo(frame.pixels);
  if (options_.modality == Modality::thermal && freeze_.mark(frame, data, needed, arrival.at))
    pending_.push_back(event_delivery(EventKind::nuc, "the image is frozen"));
  if (format.bytes == 1) {
    frame.thermal_is_gray = options_.modality == Modality::thermal;
  } else if (!temperatures_) {
    if (const auto stretch = raw_counts_.apply(frame))
      pending_.push_back(event_delivery(EventKind::raw_counts, *stretch));
  } else if (const auto clipped = temperatures_->apply(
                 frame, format.full_scale,
                 "set a hotter range in the camera, and a profile of more kelvin a count "
                 "(config/cameras/*-hot.toml)")) {
    pending_.push_back(event_delivery(EventKind::clipped, *clipped));
  }
  return delivery;
}

void AravisSource::store_no_finer_than(double kelvin_per_count) {
  least_kelvin_per_count_ = std::max(least_kelvin_per_count_, kelvin_per_count);
  if (temperatures_) temperatures_->store_no_finer_than(least_kelvin_per_count_);
}

Status AravisSource::request_correction() {
  const std::lock_guard lock(info_mutex_);
  ORBITFUSE_TRY(correctable_);
  correction_wanted_ = true;
  return {};
}

Status AravisSource::correct_nonuniformity() {
  if (!link_)
    return fail(ErrorKind::device, "NUC", "the camera is not connected", "wait until it is back");
  {
    const std::lock_guard lock(info_mutex_);
    ORBITFUSE_TRY(correctable_);
  }
  GError* error = nullptr;
  arv_camera_execute_command(link_->camera, profile_.nuc_command.c_str(), &error);
  if (error) return fail(ErrorKind::device, "NUC", take_text(error), "try again");
  freeze_.expect();
  return {};
}

Delivery AravisSource::correct_as_asked() {
  // Asking would wait for the answer, seconds long, and the stream with it.
  if (control_mute_)
    return event_delivery(EventKind::nuc_failed,
                          "the camera does not answer on its control channel");
  if (const Status status = correct_nonuniformity(); !status)
    return event_delivery(EventKind::nuc_failed, status.error().message());
  return event_delivery(EventKind::nuc, "asked for by the operator");
}

StreamStatistics& StreamStatistics::operator+=(const StreamStatistics& other) {
  completed += other.completed;
  failures += other.failures;
  underruns += other.underruns;
  resent += other.resent;
  size_mismatches += other.size_mismatches;
  return *this;
}

StreamStatistics AravisSource::statistics() const {
  StreamStatistics all = earlier_;
  return all += link_statistics();
}

std::string AravisSource::transport_report() const {
  const StreamStatistics s = statistics();
  // Not Aravis' count of missing packets: of a damaged frame it counts all after the first hole.
  return fmt::format(
      "{} buffers completed, {} failed, {} underruns; {} packets resent; {} of another size",
      s.completed, s.failures, s.underruns, s.resent, s.size_mismatches);
}

StreamStatistics AravisSource::link_statistics() const {
  StreamStatistics s;
  if (!link_ || !link_->stream) return s;
  const auto info = [&](const char* key) {
    return arv_stream_get_info_uint64_by_name(link_->stream, key);
  };
  return {info("n_completed_buffers"), info("n_failures"), info("n_underruns"),
          info("n_resent_packets"), info("n_size_mismatch_errors")};
}

}  // namespace orbitfuse::aravis
