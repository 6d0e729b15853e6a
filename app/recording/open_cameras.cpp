// SPDX-License-Identifier: BSD-3-Clause
#include "app/recording/open_cameras.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/aravis/aravis_source.hpp"
#include "drivers/network/network_source.hpp"
#include "drivers/replay/replay_source.hpp"
#include "drivers/stills/watch_source.hpp"
#include "drivers/synthetic/orbit.hpp"
#include "drivers/usb/usb_bus.hpp"
#include "drivers/v4l2/v4l2_source.hpp"

namespace orbitfuse::recording {
namespace {

namespace fs = std::filesystem;

std::string device_id(Modality modality) { return std::string(name(modality)) + "0"; }

/// A plan in which every station of the session has its place; nothing when they don't form loops.
std::optional<OrbitPlan> plan_of(const Session& session) {
  OrbitPlan plan;
  plan.loop_elevations_deg.clear();
  plan.modalities.clear();
  std::map<int, std::pair<double, int>> loops;  // sum of elevations, count
  int last_index = 0;
  for (const FrameRecord& frame : session.frames) {
    if (frame.tracking || !frame.station || !frame.station->elevation_sigma_deg) continue;
    auto& [sum, count] = loops[frame.station->loop];
    sum += frame.station->elevation_deg;
    ++count;
    last_index = std::max(last_index, frame.station->index);
    if (std::find(plan.modalities.begin(), plan.modalities.end(), frame.modality) ==
        plan.modalities.end()) {
      plan.modalities.push_back(frame.modality);
    }
  }
  for (const auto& [loop, sum] : loops) plan.loop_elevations_deg.push_back(sum.first / sum.second);
  plan.spacing_deg = 360.0 / (last_index + 1);
  plan.azimuth_tolerance_deg = std::min(plan.azimuth_tolerance_deg, plan.spacing_deg / 2);
  if (!plan.validate()) return std::nullopt;
  return plan;
}

Status add_replay(const CameraSpec& spec, Modality modality, Cameras& cameras) {
  const std::string speed = spec.value("speed");
  if (!speed.empty() && speed != "full" && speed != "recorded") {
    return fail(ErrorKind::usage, "replay", "speed=" + speed, "use speed=full or speed=recorded");
  }
  if (spec.camera.empty())
    return fail(ErrorKind::usage, "replay", "no session named", "write replay:SESSION_FOLDER");
  ORBITFUSE_ASSIGN(const Session session, open_session(spec.camera));
  const std::size_t before = cameras.sources.size();
  for (const DeviceInfo& device : session.devices) {
    const bool has_frames =
        std::any_of(session.frames.begin(), session.frames.end(),
                    [&](const FrameRecord& f) { return f.device == device.id; });
    if (device.modality != modality || !has_frames) continue;
    cameras.sources.push_back(make_replay_source(
        session, device.id, speed == "recorded" ? ReplaySpeed::recorded : ReplaySpeed::full));
  }
  if (cameras.sources.size() == before) {
    return fail(ErrorKind::input, spec.camera, fmt::format("no {} frames", name(modality)),
                "replay another session");
  }
  if (!cameras.plan) cameras.plan = plan_of(session);
  cameras.stations = cameras.plan.has_value();
  return {};
}

Status add_synthetic(const CameraSpec& spec, Modality modality, Cameras& cameras) {
  SyntheticOptions options = replay_orbit_options();
  OrbitOptions& orbit = modality == Modality::visible ? options.visible : options.thermal;
  ORBITFUSE_ASSIGN(const ImageSize wanted, size(spec, {orbit.width, orbit.height}));
  orbit.width = wanted.width;
  orbit.height = wanted.height;
  ORBITFUSE_ASSIGN(orbit.station_spacing_deg, number(spec, "spacing", orbit.station_spacing_deg));
  ORBITFUSE_TRY(options.validate());
  OrbitPlan plan;
  plan.spacing_deg = orbit.station_spacing_deg;
  plan.loop_elevations_deg = orbit.elevations_deg;
  plan.azimuth_tolerance_deg = std::min(plan.azimuth_tolerance_deg, plan.spacing_deg / 2);
  ORBITFUSE_TRY(plan.validate());
  cameras.plan = plan;
  cameras.stations = true;
  cameras.sources.push_back(make_synthetic_source(options, modality));
  return {};
}

Status add_aravis(const CameraSpec& spec, Modality modality, const fs::path& profiles,
                  Cameras& cameras) {
  aravis::AravisOptions options;
  options.camera = spec.camera;
  options.modality = modality;
  options.device_id = device_id(modality);
  options.profiles = profiles.empty() ? shipped_profiles() : profiles;
  options.profile = spec.value("profile");
  if (!options.profile.empty())
    ORBITFUSE_TRY(aravis::named_profile(options.profiles, options.profile));
  ORBITFUSE_TRY(options.validate());
  cameras.live = true;
  cameras.sources.push_back(std::make_unique<aravis::AravisSource>(options));
  return {};
}

/// What is not given the camera's automatic finds, and unless lock=no it is locked there.
Status set_controls(const CameraSpec& spec, v4l2::V4l2Options& options) {
  const auto set = [&](const char* key, double scale, std::optional<int>& value) -> Status {
    if (spec.value(key).empty()) return {};
    // Focus 0 is infinity.
    const bool infinity = std::string(key) == "focus" && spec.value(key) == "0";
    ORBITFUSE_ASSIGN(const double given, infinity ? Result<double>(0) : number(spec, key, 0));
    if (given * scale > 1e9 || (given > 0 && given * scale < 0.5))
      return fail(ErrorKind::usage, fmt::format("{} {}", spec.driver, key), spec.value(key),
                  "give what the camera can have (v4l2-ctl --list-ctrls)");
    value = static_cast<int>(std::lround(given * scale));
    return {};
  };
  ORBITFUSE_TRY(set("exposure", 10, options.exposure_100us));  // given in ms
  ORBITFUSE_TRY(set("focus", 1, options.focus));
  ORBITFUSE_TRY(set("white-balance", 1, options.white_balance_k));
  if (spec.value("lock").empty()) return {};
  ORBITFUSE_ASSIGN(const bool lock, yes_or_no(spec, "lock"));
  options.lock_exposure = options.lock_focus = options.lock_white_balance = lock;
  return {};
}

Status add_v4l2(const CameraSpec& spec, Modality modality, Cameras& cameras) {
  v4l2::V4l2Options options;
  if (!spec.camera.empty()) options.camera = spec.camera;
  options.modality = modality;
  options.device_id = device_id(modality);
  ORBITFUSE_ASSIGN(const ImageSize wanted, size(spec, {}));
  options.width = wanted.width;
  options.height = wanted.height;
  ORBITFUSE_ASSIGN(options.rate_hz, number(spec, "rate", 0));
  ORBITFUSE_ASSIGN(options.kelvin_per_dn, number(spec, "kelvin-per-dn", 0));
  options.format = spec.value("format");
  ORBITFUSE_TRY(set_controls(spec, options));
  options.reset_port = [](const std::string& port) -> Status {
    ORBITFUSE_ASSIGN(const auto bus, usb::make_usb_bus());
    return bus->reset(port);
  };
  ORBITFUSE_TRY(options.validate());
  cameras.live = true;
  cameras.sources.push_back(std::make_unique<v4l2::V4l2Source>(options));
  return {};
}

Status add_network(const CameraSpec& spec, Modality modality, Cameras& cameras) {
  if (modality == Modality::thermal) {
    return fail(ErrorKind::usage, "network", "as thermal camera",
                "what phones send is a picture without temperatures: give it as --visible");
  }
  network::NetworkOptions options;
  options.feed.url = spec.camera;
  options.device_id = device_id(modality);
  ORBITFUSE_TRY(options.validate());
  cameras.live = true;
  cameras.sources.push_back(std::make_unique<network::NetworkSource>(options));
  return {};
}

Status add_stills(const CameraSpec& spec, Modality modality, Cameras& cameras) {
  WatchOptions options;
  options.folder = spec.camera;
  options.modality = modality;
  options.device_id = device_id(modality);
  ORBITFUSE_ASSIGN(options.existing, yes_or_no(spec, "existing"));
  ORBITFUSE_ASSIGN(options.accept_gray, yes_or_no(spec, "gray"));
  ORBITFUSE_TRY(options.validate());
  cameras.live = true;
  cameras.sources.push_back(std::make_unique<WatchSource>(options));
  return {};
}

}  // namespace

fs::path shipped_profiles() {
  std::error_code error;
  fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (int up = 0; up < 5 && !folder.empty(); ++up, folder = folder.parent_path()) {
    for (const char* place : {"config/cameras", "share/orbitfuse/cameras"}) {
      if (fs::is_directory(folder / place, error)) return folder / place;
    }
  }
  return {};
}

Status add_cameras(const CameraSpec& spec, Modality modality, const fs::path& profiles,
                   Cameras& cameras) {
  if (spec.driver == "replay") return add_replay(spec, modality, cameras);
  if (spec.driver == "synthetic") return add_synthetic(spec, modality, cameras);
  if (spec.driver == "network") return add_network(spec, modality, cameras);
  if (spec.driver == "stills") return add_stills(spec, modality, cameras);
  if (spec.driver == "aravis") return add_aravis(spec, modality, profiles, cameras);
  return add_v4l2(spec, modality, cameras);
}

}  // namespace orbitfuse::recording
