// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/aravis_source.hpp"

#include <arv.h>
#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>

#include "drivers/aravis/gvcp_probe.hpp"
#include "drivers/aravis/thermal_table.hpp"

namespace orbitfuse::aravis {
namespace {

/// Takes the error's text and frees it.
std::string take(GError*& error) {
  std::string text = error ? error->message : "";
  g_clear_error(&error);
  return text;
}

std::string text(const char* value) { return value ? value : ""; }

std::int64_t wall_ns() {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

struct Format {
  int cv_type, bytes;
};
std::optional<Format> format_of(ArvPixelFormat format) {
  switch (format) {
    case ARV_PIXEL_FORMAT_MONO_8: return Format{CV_8UC1, 1};
    case ARV_PIXEL_FORMAT_MONO_10:
    case ARV_PIXEL_FORMAT_MONO_12:
    case ARV_PIXEL_FORMAT_MONO_14:
    case ARV_PIXEL_FORMAT_MONO_16: return Format{CV_16UC1, 2};
    default: return std::nullopt;
  }
}

/// Packets and their resending don't wait for a busy machine, where the system allows that
/// (RLIMIT_RTPRIO or RLIMIT_NICE); without the right it is as before.
void prefer_receiving(void* /*data*/, ArvStreamCallbackType type, ArvBuffer* /*buffer*/) {
  if (type != ARV_STREAM_CALLBACK_TYPE_INIT) return;
  if (!arv_make_thread_realtime(10)) arv_make_thread_high_priority(-10);
}

}  // namespace

/// The Aravis objects of one connection; destroying them may block for seconds.
struct AravisSource::Link {
  ArvCamera* camera = nullptr;
  ArvStream* stream = nullptr;
  std::atomic<bool> control_lost{false};
  int width = 0, height = 0;
  ArvPixelFormat pixel_format = 0;
  std::size_t payload = 0;

  ~Link() {
    if (camera) {
      arv_camera_stop_acquisition(camera, nullptr);
      g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera), this);
    }
    g_clear_object(&stream);
    g_clear_object(&camera);
  }
  static void on_control_lost(ArvDevice*, void* self) { static_cast<Link*>(self)->control_lost = true; }
};

Status AravisOptions::validate() const {
  if (buffers < 2) return fail(ErrorKind::usage, "aravis.buffers", fmt::format("{}", buffers), "must be >= 2");
  if (silence.count() <= 0 || give_up < silence) {
    return fail(ErrorKind::usage, "aravis.give_up", fmt::format("{} ms", give_up.count()), "must be > 0 and >= silence");
  }
  if (nuc_settle.count() < 0) return fail(ErrorKind::usage, "aravis.nuc_settle", "negative", "must be >= 0");
  return {};
}

AravisSource::AravisSource(AravisOptions options) : options_(std::move(options)) {
  info_.id = options_.device_id;
  info_.modality = options_.modality;
  info_.driver = "aravis";
}

AravisSource::~AravisSource() { stop(); }

DeviceInfo AravisSource::describe() const { return info_; }

Status AravisSource::start() {
  ORBITFUSE_TRY(options_.validate());
  return open();
}

Status AravisSource::open() {
  auto link = std::make_shared<Link>();
  const std::string wanted = address_.empty() ? options_.camera : address_;
  const std::string where = wanted.empty() ? "GigE Vision camera" : "camera " + wanted;
  GError* error = nullptr;
  link->camera = arv_camera_new(wanted.empty() ? nullptr : wanted.c_str(), &error);
  if (!link->camera) {
    return fail(ErrorKind::device, where, take(error), "check power, cable and subnet (orbitfuse doctor)");
  }
  ArvDevice* device = arv_camera_get_device(link->camera);
  info_.model = text(arv_camera_get_model_name(link->camera, nullptr));
  info_.serial = text(arv_camera_get_device_id(link->camera, nullptr));
  // Without control no "control-lost" is ever emitted and every write times out.
  if (ARV_IS_GV_DEVICE(device) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device))) {
    return fail(ErrorKind::device, where, "controlled by another program or computer", "close that program and try again");
  }
  g_signal_connect(device, "control-lost", G_CALLBACK(Link::on_control_lost), link.get());
  if (ARV_IS_GV_DEVICE(device)) {
    auto* socket_address = G_INET_SOCKET_ADDRESS(arv_gv_device_get_device_address(ARV_GV_DEVICE(device)));
    char* ip = g_inet_address_to_string(g_inet_socket_address_get_address(socket_address));
    address_ = ip;
    g_free(ip);
    // The packet size found by Aravis' probing must not change between reconnections.
    arv_gv_device_set_packet_size_adjustment(ARV_GV_DEVICE(device), ARV_GV_PACKET_SIZE_ADJUSTMENT_ON_FAILURE_ONCE);
  }
  link_ = link;
  const auto prepare = [&]() -> Status {
    ORBITFUSE_TRY(push_settings());
    ORBITFUSE_ASSIGN(table_, temperature_table());
    gint x = 0, y = 0;
    arv_camera_get_region(link->camera, &x, &y, &link->width, &link->height, nullptr);
    link->pixel_format = arv_camera_get_pixel_format(link->camera, nullptr);
    const std::optional<Format> format = format_of(link->pixel_format);
    if (!format) {
      return fail(ErrorKind::device, where, "sends a pixel format other than Mono8..Mono16", "set PixelFormat in its profile");
    }
    link->payload = arv_camera_get_payload(link->camera, &error);
    if (error) return fail(ErrorKind::device, where, take(error), "power-cycle the camera");
    if (link->payload < static_cast<std::size_t>(link->width) * static_cast<std::size_t>(link->height) * static_cast<std::size_t>(format->bytes)) {
      return fail(ErrorKind::device, where, "its payload is smaller than its image", "power-cycle the camera");
    }
    link->stream = arv_camera_create_stream(link->camera, prefer_receiving, nullptr, &error);
    if (!link->stream) return fail(ErrorKind::device, where, take(error), "check the network (orbitfuse doctor)");
    // Aravis gives a frame 200 ms for its resent packets; a loaded host needs longer now and then.
    if (ARV_IS_GV_STREAM(link->stream)) g_object_set(link->stream, "frame-retention", 300'000u, nullptr);
    for (int i = 0; i < options_.buffers; ++i) arv_stream_push_buffer(link->stream, arv_buffer_new(link->payload, nullptr));
    arv_camera_start_acquisition(link->camera, &error);
    if (error) return fail(ErrorKind::device, where, take(error), "power-cycle the camera");
    return {};
  };
  if (Status status = prepare(); !status) {
    bury_link();
    return status;
  }
  counter_ = {};
  base_id_ = next_id_;
  mismatches_ = 0;
  silent_told_ = false;
  last_frame_ = Clock::now();
  watch_control();
  return {};
}

/// Frames go on for seconds after the control channel has died, until the camera's heartbeat ends;
/// Aravis tells only then. Two unanswered questions in a row are an early word, not a verdict.
void AravisSource::watch_control() {
  control_mute_ = mute_told_ = false;
  if (address_.empty()) return;
  control_watch_ = std::jthread([this, address = address_](const std::stop_token& over) {
    for (int unanswered = 0; !over.stop_requested();) {
      unanswered = answers(address, std::chrono::milliseconds(80)) ? 0 : unanswered + 1;
      control_mute_ = unanswered >= 2;
      for (int i = 0; i < 4 && !over.stop_requested(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(25));
    }
  });
}

Status AravisSource::push_settings() {
  if (profile_.name.empty()) {
    if (options_.profiles.empty()) {
      profile_.name = "generic";
    } else if (!options_.profile.empty()) {
      ORBITFUSE_ASSIGN(profile_, named_profile(options_.profiles, options_.profile));
    } else {
      ORBITFUSE_ASSIGN(profile_, find_profile(options_.profiles, info_.model));
    }
  }
  ArvCamera* camera = link_->camera;
  for (const auto& [feature, value] : profile_.settings) {
    const std::string where = "profile " + profile_.name + ": " + feature;
    if (!arv_camera_is_feature_available(camera, feature.c_str(), nullptr)) {
      return fail(ErrorKind::usage, where, "the camera " + info_.model + " has no such feature",
                  "correct the profile in config/cameras or choose another");
    }
    GError* error = nullptr;
    bool verified = false;
    if (const auto* b = std::get_if<bool>(&value)) {
      arv_camera_set_boolean(camera, feature.c_str(), *b, &error);
      verified = !error && static_cast<bool>(arv_camera_get_boolean(camera, feature.c_str(), &error)) == *b;
    } else if (const auto* i = std::get_if<std::int64_t>(&value)) {
      arv_camera_set_integer(camera, feature.c_str(), *i, &error);
      verified = !error && arv_camera_get_integer(camera, feature.c_str(), &error) == *i;
    } else if (const auto* d = std::get_if<double>(&value)) {
      arv_camera_set_float(camera, feature.c_str(), *d, &error);
      verified = !error && std::abs(arv_camera_get_float(camera, feature.c_str(), &error) - *d) <= 1e-6 * std::abs(*d);
    } else {
      const std::string& s = std::get<std::string>(value);
      arv_camera_set_string(camera, feature.c_str(), s.c_str(), &error);
      verified = !error && text(arv_camera_get_string(camera, feature.c_str(), &error)) == s;
    }
    if (error || !verified) {
      const std::string why = error ? take(error) : "reads back another value";
      return fail(ErrorKind::device, where, why, "correct the profile, or close another program that controls the camera");
    }
  }
  return {};
}

Result<std::vector<std::uint16_t>> AravisSource::temperature_table() {
  if (profile_.scale == ThermalScale::none) return std::vector<std::uint16_t>{};
  if (profile_.scale == ThermalScale::linear) return linear_table(profile_.kelvin_per_dn);
  PlanckParameters parameters;
  for (const auto& [node, field] : {std::pair<const char*, double*>{"R", &parameters.r}, {"B", &parameters.b},
                                    {"F", &parameters.f}, {"J0", &parameters.j0}, {"J1", &parameters.j1},
                                    {"ObjectEmissivity", &parameters.emissivity},
                                    {"ReflectedTemperature", &parameters.reflected_k}}) {
    GError* error = nullptr;
    *field = arv_camera_get_float(link_->camera, node, &error);
    if (error) return fail(ErrorKind::device, std::string("node ") + node, take(error), "choose a profile with scale = \"linear\"");
  }
  return planck_table(parameters);
}

/// Destroying a connection can block for seconds while the camera does not answer.
void AravisSource::bury_link() {
  control_watch_ = {};
  if (!link_) return;
  graves_.emplace_back([link = std::move(link_)]() mutable { link.reset(); });
  link_ = nullptr;
}

void AravisSource::stop() {
  bury_link();
  for (std::thread& grave : graves_) grave.join();
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
  lost_at_ = last_frame_;
  last_attempt_ = {};
  return event("disconnected", why);
}

std::optional<Delivery> AravisSource::try_reopen() {
  using namespace std::chrono_literals;
  if (Clock::now() - last_attempt_ < 200ms) return std::nullopt;
  last_attempt_ = Clock::now();
  if (!answers(address_, 100ms) || !open()) return std::nullopt;
  away_ = false;
  const double outage_s = std::chrono::duration<double>(Clock::now() - lost_at_).count();
  const auto cost = interval_s_ > 0 ? static_cast<std::uint64_t>(std::llround(outage_s / interval_s_)) : 1;
  base_id_ += cost;
  return event("reconnected", fmt::format("{} after {:.1f} s, about {} frames; settings pushed and verified", address_, outage_s, cost));
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
  if (!link_) return fail(ErrorKind::device, "camera " + options_.camera, "not started", "call start() first");
  if (link_->control_lost) return lose("control lost");
  if (control_mute_ != mute_told_) {
    mute_told_ = control_mute_;
    return event(mute_told_ ? "control-silent" : "control-back", address_);
  }
  const auto wait = std::min(timeout, options_.silence / 2);
  ArvBuffer* buffer = arv_stream_timeout_pop_buffer(
      link_->stream, static_cast<guint64>(std::chrono::duration_cast<std::chrono::microseconds>(wait).count()));
  if (!buffer) {
    const auto quiet = Clock::now() - last_frame_;
    if (quiet > options_.give_up) return lose("no frame for a second; reopening it");
    if (quiet > options_.silence && !silent_told_) {
      silent_told_ = true;
      return event("silent", fmt::format("no frame for {} ms", options_.silence.count()));
    }
    return Delivery{};
  }
  Delivery delivery = inspect(buffer);
  arv_stream_push_buffer(link_->stream, buffer);
  return delivery;
}

Delivery AravisSource::inspect(void* handle) {
  auto* buffer = static_cast<ArvBuffer*>(handle);
  Delivery delivery;
  delivery.kind = Delivery::Kind::rejected;
  const std::int64_t arrival_ns = wall_ns();
  const auto frame_id = static_cast<std::uint16_t>(arv_buffer_get_frame_id(buffer));
  const std::optional<std::uint64_t> count = counter_.unwrap(frame_id);
  if (!count) {
    // A frame number that was counted already: late packets of a frame that was given up.
    return event("duplicate", fmt::format("frame id {} again", frame_id));
  }
  delivery.frame.id = base_id_ + *count;
  next_id_ = delivery.frame.id + 1;

  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  guint64 mismatches = arv_stream_get_info_uint64_by_name(link_->stream, "n_size_mismatch_errors");
  const bool mismatch = mismatches != mismatches_;
  mismatches_ = mismatches;
  if (status != ARV_BUFFER_STATUS_SUCCESS) {
    const bool packets = status == ARV_BUFFER_STATUS_MISSING_PACKETS || status == ARV_BUFFER_STATUS_TIMEOUT;
    delivery.reason = packets ? "packets are missing" : fmt::format("Aravis status {}", static_cast<int>(status));
    if (mismatch) delivery.reason += ", larger than announced";
    return delivery;
  }
  const double interval_s = std::chrono::duration<double>(Clock::now() - last_frame_).count();
  if (interval_s < 1) interval_s_ = interval_s_ > 0 ? 0.9 * interval_s_ + 0.1 * interval_s : interval_s;
  last_frame_ = Clock::now();
  silent_told_ = false;
  const int width = arv_buffer_get_image_width(buffer), height = arv_buffer_get_image_height(buffer);
  const ArvPixelFormat pixel_format = arv_buffer_get_image_pixel_format(buffer);
  if (mismatch || width != link_->width || height != link_->height) {
    delivery.reason = fmt::format("{}x{} where {}x{} is set", width, height, link_->width, link_->height);
    return delivery;
  }
  if (pixel_format != link_->pixel_format) {
    delivery.reason = fmt::format("pixel format {:#x} where {:#x} is set", pixel_format, link_->pixel_format);
    return delivery;
  }
  const Format format = *format_of(pixel_format);
  std::size_t size = 0;
  const void* data = arv_buffer_get_data(buffer, &size);
  const std::size_t needed = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(format.bytes);
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
  mark_nuc(frame, data, needed);
  if (format.bytes == 1) {
    frame.thermal_is_gray = options_.modality == Modality::thermal;
  } else if (table_.empty()) {
    if (const auto stretch = raw_counts_.apply(frame)) pending_.push_back(event("raw-counts", *stretch));
  } else {
    frame.pixels.forEach<std::uint16_t>([this](std::uint16_t& dn, const int*) { dn = table_[dn]; });
  }
  return delivery;
}

/// A thermal sensor never repeats its noise: equal frames mean that the shutter is closed.
void AravisSource::mark_nuc(Frame& frame, const void* data, std::size_t size) {
  const std::uint64_t hash = XXH3_64bits(data, size);
  const bool frozen = hash == last_hash_;
  last_hash_ = hash;
  if (frozen) {
    nuc_until_ = Clock::now() + options_.nuc_settle;
    if (!frozen_) pending_.push_back(event("nuc", "the image is frozen"));
  }
  frozen_ = frozen;
  if (Clock::now() < nuc_until_) frame.flags.push_back("nuc");
}

Status AravisSource::correct_nonuniformity() {
  if (!link_) return fail(ErrorKind::device, "NUC", "the camera is not connected", "wait until it is back");
  if (profile_.nuc_command.empty()) return fail(ErrorKind::unavailable, "NUC", "not known for " + profile_.name, "set nuc_command in its profile");
  GError* error = nullptr;
  arv_camera_execute_command(link_->camera, profile_.nuc_command.c_str(), &error);
  if (error) return fail(ErrorKind::device, "NUC", take(error), "try again");
  nuc_until_ = Clock::now() + options_.nuc_settle;
  return {};
}

StreamStatistics AravisSource::statistics() const {
  StreamStatistics s;
  if (!link_ || !link_->stream) return s;
  const auto info = [&](const char* key) { return arv_stream_get_info_uint64_by_name(link_->stream, key); };
  return {info("n_completed_buffers"), info("n_failures"), info("n_underruns"), info("n_resent_packets"),
          info("n_missing_packets"), info("n_size_mismatch_errors")};
}

std::vector<FoundCamera> discover() {
  arv_update_device_list();
  std::vector<FoundCamera> found;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    found.push_back({text(arv_get_device_id(i)), text(arv_get_device_model(i)), text(arv_get_device_serial_nbr(i)),
                     text(arv_get_device_address(i))});
  }
  return found;
}

}  // namespace orbitfuse::aravis
