// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/aravis_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "drivers/aravis/gvcp_probe.hpp"
#include "drivers/aravis/link.hpp"

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

/// Destroying a connection can block for seconds while the camera does not answer.
void AravisSource::bury_link() {
  control_watch_ = {};
  if (!link_) return;
  earlier_ += link_statistics();
  std::erase_if(graves_, [](Grave& grave) {
    if (!*grave.done) return false;
    grave.thread.join();
    return true;
  });
  auto done = std::make_shared<std::atomic<bool>>(false);
  graves_.push_back({done, std::thread([link = std::move(link_), done]() mutable {
                       link.reset();
                       *done = true;
                     })});
  link_ = nullptr;
}

void AravisSource::stop() {
  bury_link();
  for (Grave& grave : graves_) grave.thread.join();
  graves_.clear();
  away_ = false;
}

Delivery AravisSource::event(std::string kind, std::string detail) const {
  Delivery delivery;
  delivery.kind = Delivery::Kind::event;
  delivery.reason = std::move(kind);
  delivery.detail = std::move(detail);
  return delivery;
}

Delivery AravisSource::lose(const std::string& why) {
  bury_link();
  away_ = true;
  rhythm_.interrupt();
  lost_at_ = last_frame_;
  last_attempt_ = {};
  return event("disconnected", why);
}

std::optional<Delivery> AravisSource::try_reopen() {
  using namespace std::chrono_literals;
  if (Clock::now() - last_attempt_ < 200ms) return std::nullopt;
  last_attempt_ = Clock::now();
  if (!answers(address_, 100ms)) return std::nullopt;
  if (const Status status = open(); !status) {
    if (!failure_.note(status.error().message())) return std::nullopt;
    return event("reopen-failed", status.error().message());
  }
  failure_.clear();
  away_ = false;
  const double outage_s = std::chrono::duration<double>(Clock::now() - lost_at_).count();
  const std::uint64_t cost = rhythm_.frames_in(outage_s);
  next_id_ = base_id_ += cost;  // also if it is lost again before a frame
  return event("reconnected",
               fmt::format("{} after {:.1f} s, about {} frames; settings pushed and verified",
                           address_, outage_s, cost));
}

Result<Delivery> AravisSource::next(std::chrono::milliseconds timeout) {
  if (!pending_.empty()) {
    Delivery delivery = std::move(pending_.front());
    pending_.erase(pending_.begin());
    return delivery;
  }
  if (away_) {
    if (std::optional<Delivery> back = try_reopen()) return std::move(*back);
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
    return event(mute_told_ ? "control-silent" : "control-back", address_);
  }
  const auto wait = std::min(timeout, options_.silence / 2);
  ArvBuffer* buffer = arv_stream_timeout_pop_buffer(
      link_->stream,
      static_cast<guint64>(std::chrono::duration_cast<std::chrono::microseconds>(wait).count()));
  if (!buffer) {
    const auto quiet = Clock::now() - last_frame_;
    if (quiet > options_.give_up) return lose("no frame for a second; reopening it");
    if (quiet > options_.silence && !silent_told_) {
      silent_told_ = true;
      return event("silent", fmt::format("no frame for {} ms", options_.silence.count()));
    }
    return Delivery{};
  }
  last_frame_ = Clock::now();  // damaged or not: the stream lives
  silent_told_ = false;
  Delivery delivery = inspect(buffer);
  arv_stream_push_buffer(link_->stream, buffer);
  // Late packets make one such frame; a camera that counts from 1 again makes nothing else.
  if (duplicates_in_a_row_ >= 3) return lose("the camera's frame numbers restarted; reopening it");
  return delivery;
}

Delivery AravisSource::inspect(void* handle) {
  auto* buffer = static_cast<ArvBuffer*>(handle);
  Delivery delivery;
  delivery.kind = Delivery::Kind::rejected;
  const std::int64_t arrival_ns = arrival_of(buffer);
  const Clock::time_point came_at = Clock::now() - std::chrono::nanoseconds(wall_ns() - arrival_ns);
  const auto frame_id = static_cast<std::uint16_t>(arv_buffer_get_frame_id(buffer));
  const std::optional<std::uint64_t> count = counter_.unwrap(frame_id);
  if (!count) {
    // A frame number that was counted already: late packets of a frame that was given up.
    ++duplicates_in_a_row_;
    return event("duplicate", fmt::format("frame id {} again", frame_id));
  }
  duplicates_in_a_row_ = 0;
  delivery.frame.id = base_id_ + *count;
  next_id_ = delivery.frame.id + 1;
  rhythm_.note(delivery.frame.id,
               std::chrono::duration_cast<std::chrono::nanoseconds>(came_at.time_since_epoch()).count());

  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  guint64 mismatches = arv_stream_get_info_uint64_by_name(link_->stream, "n_size_mismatch_errors");
  const bool mismatch = mismatches != mismatches_;
  mismatches_ = mismatches;
  if (status != ARV_BUFFER_STATUS_SUCCESS) {
    const bool packets =
        status == ARV_BUFFER_STATUS_MISSING_PACKETS || status == ARV_BUFFER_STATUS_TIMEOUT;
    delivery.reason =
        packets ? "packets are missing" : fmt::format("Aravis status {}", static_cast<int>(status));
    if (mismatch) delivery.reason += ", larger than announced";
    return delivery;
  }
  const int width = arv_buffer_get_image_width(buffer),
            height = arv_buffer_get_image_height(buffer);
  const ArvPixelFormat pixel_format = arv_buffer_get_image_pixel_format(buffer);
  if (mismatch || width != link_->width || height != link_->height) {
    delivery.reason =
        fmt::format("{}x{} where {}x{} is set", width, height, link_->width, link_->height);
    return delivery;
  }
  if (pixel_format != link_->pixel_format) {
    delivery.reason =
        fmt::format("pixel format {:#x} where {:#x} is set", pixel_format, link_->pixel_format);
    return delivery;
  }
  const Format format = *format_of(pixel_format);
  std::size_t size = 0;
  const void* data = arv_buffer_get_data(buffer, &size);
  const std::size_t needed = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                             static_cast<std::size_t>(format.bytes);
  if (size < needed) {
    delivery.reason = fmt::format("{} bytes where {} are needed", size, needed);
    return delivery;
  }

  delivery.kind = Delivery::Kind::frame;
  Frame& frame = delivery.frame;
  frame.device_time_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer));
  const ClockMap::Stamp stamp = clock_.add(frame.device_time_ns, arrival_ns);
  frame.host_time_ns = stamp.host_time_ns;
  if (stamp.event) pending_.push_back(event("clock", *stamp.event));
  cv::Mat(height, width, format.cv_type, const_cast<void*>(data)).copyTo(frame.pixels);
  if (options_.modality == Modality::thermal && freeze_.mark(frame, data, needed, came_at))
    pending_.push_back(event("nuc", "the image is frozen"));
  if (format.bytes == 1) {
    frame.thermal_is_gray = options_.modality == Modality::thermal;
  } else if (table_.empty()) {
    if (const auto stretch = raw_counts_.apply(frame))
      pending_.push_back(event("raw-counts", *stretch));
  } else {
    frame.pixels.forEach<std::uint16_t>([this](std::uint16_t& dn, const int*) { dn = table_[dn]; });
  }
  return delivery;
}

Status AravisSource::correct_nonuniformity() {
  if (!link_)
    return fail(ErrorKind::device, "NUC", "the camera is not connected", "wait until it is back");
  if (profile_.nuc_command.empty())
    return fail(ErrorKind::unavailable, "NUC", "not known for " + profile_.name,
                "set nuc_command in its profile");
  GError* error = nullptr;
  arv_camera_execute_command(link_->camera, profile_.nuc_command.c_str(), &error);
  if (error) return fail(ErrorKind::device, "NUC", take(error), "try again");
  freeze_.expect();
  return {};
}

Delivery AravisSource::correct_as_asked() {
  // Asking would wait for the answer, seconds long, and the stream with it.
  if (control_mute_) return event("nuc-failed", "the camera does not answer on its control channel");
  if (const Status status = correct_nonuniformity(); !status)
    return event("nuc-failed", status.error().message());
  return event("nuc", "asked for by the operator");
}

StreamStatistics& StreamStatistics::operator+=(const StreamStatistics& other) {
  completed += other.completed;
  failures += other.failures;
  underruns += other.underruns;
  resent += other.resent;
  missing_packets += other.missing_packets;
  size_mismatches += other.size_mismatches;
  return *this;
}

StreamStatistics AravisSource::statistics() const {
  StreamStatistics all = earlier_;
  return all += link_statistics();
}

std::string AravisSource::transport_report() const {
  const StreamStatistics s = statistics();
  return fmt::format(
      "{} buffers completed, {} failed, {} underruns; {} packets resent, {} missing; {} of another "
      "size",
      s.completed, s.failures, s.underruns, s.resent, s.missing_packets, s.size_mismatches);
}

StreamStatistics AravisSource::link_statistics() const {
  StreamStatistics s;
  if (!link_ || !link_->stream) return s;
  const auto info = [&](const char* key) {
    return arv_stream_get_info_uint64_by_name(link_->stream, key);
  };
  return {info("n_completed_buffers"), info("n_failures"),        info("n_underruns"),
          info("n_resent_packets"),    info("n_missing_packets"), info("n_size_mismatch_errors")};
}

}  // namespace orbitfuse::aravis
