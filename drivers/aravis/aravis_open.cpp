// SPDX-License-Identifier: BSD-3-Clause
// From a name to a running stream: control, profile, temperatures, buffers.
#include <fmt/format.h>

#include <cmath>

#include "drivers/aravis/gvcp_probe.hpp"
#include "drivers/aravis/link.hpp"
#include "drivers/aravis/teardown.hpp"
#include "drivers/aravis/thermal_table.hpp"

namespace orbitfuse::aravis {
namespace {

using namespace std::chrono_literals;

/// An earlier connection blocks for seconds where its camera doesn't answer (teardown.hpp); one
/// that takes longer than this is told.
constexpr auto teardown_patience = 5s;
/// The control channel is asked ten times a second, and two questions in a row without an answer in
/// time tell that it is mute: within the half second in which silence is told.
constexpr auto control_patience = 80ms;
constexpr int mute_after = 2;
/// The pause between questions, in parts, so that the watch ends soon.
constexpr auto pause_part = 25ms;
constexpr int pause_parts = 4;

/// Packets and their resending don't wait for a busy machine, where the system allows that
/// (RLIMIT_RTPRIO or RLIMIT_NICE); without the right it is as before.
void prefer_receiving(void* /*data*/, ArvStreamCallbackType type, ArvBuffer* /*buffer*/) {
  if (type != ARV_STREAM_CALLBACK_TYPE_INIT) return;
  if (!arv_make_thread_realtime(10)) arv_make_thread_high_priority(-10);
}

}  // namespace

std::optional<Format> format_of(ArvPixelFormat format) {
  switch (format) {
    case ARV_PIXEL_FORMAT_MONO_8:
      return Format{CV_8UC1, 1, 0xff};
    case ARV_PIXEL_FORMAT_MONO_10:
      return Format{CV_16UC1, 2, 0x3ff};
    case ARV_PIXEL_FORMAT_MONO_12:
      return Format{CV_16UC1, 2, 0xfff};
    case ARV_PIXEL_FORMAT_MONO_14:
      return Format{CV_16UC1, 2, 0x3fff};
    case ARV_PIXEL_FORMAT_MONO_16:
      return Format{CV_16UC1, 2, 0xffff};
    default:
      return std::nullopt;
  }
}

Status AravisSource::open() {
  // An earlier source of this program may have had the same camera, under any of its names.
  if (!Teardowns::all().wait(address_, teardown_patience))
    return fail(ErrorKind::device, "camera " + options_.camera,
                "an earlier connection to it is still being closed", "try again in a few seconds");
  auto link = std::make_shared<Link>();
  const std::string wanted = address_.empty() ? options_.camera : address_;
  const std::string where = wanted.empty() ? "GigE Vision camera" : "camera " + wanted;
  GError* error = nullptr;
  link->camera = arv_camera_new(wanted.empty() ? nullptr : wanted.c_str(), &error);
  if (!link->camera) {
    return fail(ErrorKind::device, where, take_text(error),
                "check power, cable and subnet (orbitfuse doctor)");
  }
  ArvDevice* device = arv_camera_get_device(link->camera);
  const std::string model = text(arv_camera_get_model_name(link->camera, nullptr));
  const std::string serial = text(arv_camera_get_device_id(link->camera, nullptr));
  if (first_image_ && (serial != info_.serial || model != info_.model)) {
    return fail(ErrorKind::device, where,
                fmt::format("camera {} {} answers, the session's is {} {}", model, serial,
                            info_.model, info_.serial),
                "give each camera an address of its own");
  }
  {
    const std::lock_guard lock(info_mutex_);
    info_.model = model;
    info_.serial = serial;
  }
  // Without control no "control-lost" is ever emitted and every write times out.
  if (ARV_IS_GV_DEVICE(device) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device))) {
    return fail(ErrorKind::device, where, "controlled by another program or computer",
                "close that program and try again");
  }
  g_signal_connect(device, "control-lost", G_CALLBACK(Link::on_control_lost), link.get());
  if (ARV_IS_GV_DEVICE(device)) {
    auto* socket_address =
        G_INET_SOCKET_ADDRESS(arv_gv_device_get_device_address(ARV_GV_DEVICE(device)));
    char* ip = g_inet_address_to_string(g_inet_socket_address_get_address(socket_address));
    address_ = ip;
    g_free(ip);
    // The packet size found by Aravis' probing must not change between reconnections.
    arv_gv_device_set_packet_size_adjustment(ARV_GV_DEVICE(device),
                                             ARV_GV_PACKET_SIZE_ADJUSTMENT_ON_FAILURE_ONCE);
  }
  link_ = link;
  // Whoever had it before may have left it streaming, and then it refuses settings.
  arv_camera_stop_acquisition(link->camera, nullptr);
  const auto prepare = [&]() -> Status {
    ORBITFUSE_TRY(push_settings());
    ORBITFUSE_ASSIGN(std::optional<ThermalSamples> fresh, temperatures());
    if (temperatures_) store_no_finer_than(temperatures_->kelvin_per_count());
    if (fresh) fresh->store_no_finer_than(least_kelvin_per_count_);
    temperatures_ = std::move(fresh);
    ORBITFUSE_TRY(settle_image(*link, where));
    const std::optional<Format> format = format_of(link->pixel_format);
    if (!format) {
      return fail(ErrorKind::device, where, "sends a pixel format other than Mono8..Mono16",
                  "set PixelFormat in its profile");
    }
    link->payload = arv_camera_get_payload(link->camera, &error);
    if (error) return fail(ErrorKind::device, where, take_text(error), "power-cycle the camera");
    if (link->payload < static_cast<std::size_t>(link->width) *
                            static_cast<std::size_t>(link->height) *
                            static_cast<std::size_t>(format->bytes)) {
      return fail(ErrorKind::device, where, "its payload is smaller than its image",
                  "power-cycle the camera");
    }
    link->stream = arv_camera_create_stream(link->camera, prefer_receiving, nullptr, &error);
    if (!link->stream)
      return fail(ErrorKind::device, where, take_text(error),
                  "check the network (orbitfuse doctor)");
    // Aravis gives a frame 200 ms for its resent packets; a loaded host needs longer now and then.
    if (ARV_IS_GV_STREAM(link->stream))
      g_object_set(link->stream, "frame-retention", 300'000u, nullptr);
    for (int i = 0; i < options_.buffers; ++i)
      arv_stream_push_buffer(link->stream, arv_buffer_new(link->payload, nullptr));
    arv_camera_start_acquisition(link->camera, &error);
    if (error) return fail(ErrorKind::device, where, take_text(error), "power-cycle the camera");
    return {};
  };
  if (Status status = prepare(); !status) {
    bury_link();
    return status;
  }
  first_image_ = Image{link->width, link->height, link->pixel_format};
  counter_ = {};
  duplicates_in_a_row_ = 0;
  base_id_ = next_id_;
  mismatches_ = 0;
  silent_told_ = false;
  last_frame_ = Clock::now();
  watch_control();
  return {};
}

/// Reads what the camera sends. A camera that was switched off may come back with another size; a
/// session keeps its first.
Status AravisSource::settle_image(Link& link, const std::string& where) {
  GError* error = nullptr;
  gint x = 0, y = 0;
  const auto read = [&]() -> Status {
    arv_camera_get_region(link.camera, &x, &y, &link.width, &link.height, &error);
    if (!error) link.pixel_format = arv_camera_get_pixel_format(link.camera, &error);
    if (error) return fail(ErrorKind::device, where, take_text(error), "power-cycle the camera");
    return {};
  };
  ORBITFUSE_TRY(read());
  if (link.width <= 0 || link.height <= 0) {
    return fail(ErrorKind::device, where,
                fmt::format("its image is {}x{}", link.width, link.height),
                "set Width and Height in its profile");
  }
  const auto as_first = [&] {
    return link.width == first_image_->width && link.height == first_image_->height &&
           link.pixel_format == first_image_->pixel_format;
  };
  if (!first_image_ || as_first()) return {};
  const Image found{link.width, link.height, link.pixel_format};
  arv_camera_set_pixel_format(link.camera, first_image_->pixel_format, &error);
  g_clear_error(&error);  // reading back decides
  arv_camera_set_region(link.camera, x, y, first_image_->width, first_image_->height, &error);
  g_clear_error(&error);
  ORBITFUSE_TRY(read());
  if (as_first()) return {};
  return fail(ErrorKind::device, where,
              fmt::format("came back with {}x{} (format {:#x}), the session's is {}x{} ({:#x})",
                          found.width, found.height, found.pixel_format, first_image_->width,
                          first_image_->height, first_image_->pixel_format),
              "set it as before, or stop and record a session of its own");
}

/// Frames go on for seconds after the control channel has died, until the camera's heartbeat ends;
/// Aravis tells only then. Two unanswered questions in a row are an early word, not a verdict.
void AravisSource::watch_control() {
  control_mute_ = mute_told_ = false;
  if (address_.empty()) return;
  control_watch_ = std::jthread([this, address = address_](const std::stop_token& over) {
    for (int unanswered = 0; !over.stop_requested();) {
      unanswered = answers(address, control_patience) ? 0 : unanswered + 1;
      control_mute_ = unanswered >= mute_after;
      for (int i = 0; i < pause_parts && !over.stop_requested(); ++i)
        std::this_thread::sleep_for(pause_part);
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
  {
    const std::lock_guard lock(info_mutex_);
    correctable_ = {};
    if (profile_.nuc_command.empty())
      correctable_ = fail(ErrorKind::unavailable, info_.id + ": shutter correction (NUC)",
                          "the profile " + profile_.name + " names no command for it",
                          "set nuc_command in it (config/cameras)");
  }
  for (const auto& [feature, value] : profile_.settings)
    ORBITFUSE_TRY(push_setting(link_->camera, "profile " + profile_.name, feature, value));
  return {};
}

Result<std::optional<ThermalSamples>> AravisSource::temperatures() {
  if (profile_.scale == SampleScale::none) return std::nullopt;
  if (profile_.scale == SampleScale::linear) return ThermalSamples::linear(profile_.kelvin_per_dn);
  PlanckParameters parameters;
  for (const auto& [node, field] : {std::pair<const char*, double*>{"R", &parameters.r},
                                    {"B", &parameters.b},
                                    {"F", &parameters.f},
                                    {"J0", &parameters.j0},
                                    {"J1", &parameters.j1},
                                    {"ObjectEmissivity", &parameters.emissivity},
                                    {"ReflectedTemperature", &parameters.reflected_k}}) {
    GError* error = nullptr;
    *field = arv_camera_get_float(link_->camera, node, &error);
    if (error)
      return fail(ErrorKind::device, std::string("node ") + node, take_text(error),
                  "choose a profile with scale = \"linear\"");
  }
  ORBITFUSE_ASSIGN(std::vector<double> kelvin, planck_table(parameters));
  return ThermalSamples::table(std::move(kelvin));
}

}  // namespace orbitfuse::aravis
