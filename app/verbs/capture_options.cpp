// SPDX-License-Identifier: BSD-3-Clause
#include "app/verbs/capture_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "app/cli/option_pairs.hpp"
#include "app/cli/typed_options.hpp"
#include "capture/mat/mat_finder.hpp"

namespace orbitfuse::cli {
namespace {

tl::unexpected<Error> wrong(const char* option, const std::string& value, const char* remedy) {
  return fail(ErrorKind::usage, option, value, remedy);
}

std::string text(double value) { return fmt::format("{:g}", value); }

/// Where cameras stand is seen on the mat, and not told otherwise.
bool looks_for_mat(const CaptureOptions& o, const recording::Cameras& cameras) {
  return o.guide == "auto" && !o.turntable_deg && !cameras.stations;
}

/// What is recorded there would come in again as a photo.
Status check_watched(const recording::CameraSpec& spec, const std::string& session) {
  std::error_code error;
  const auto whole = [&](const std::string& name) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(name, error), error);
  };
  const auto watched = whole(spec.camera);
  auto folder = whole(session);
  if (!folder.has_filename()) folder = folder.parent_path();
  const auto apart = std::mismatch(folder.begin(), folder.end(), watched.begin(), watched.end());
  if (spec.driver != "stills" || spec.camera.empty() || apart.first != folder.end()) return {};
  return fail(ErrorKind::usage, "stills:" + spec.camera,
              "lies in the session that it is recorded into",
              "name the folder where photos arrive");
}

/// The first option that only a guide obeys; null: none.
const char* option_for_guide(const CaptureOptions& o) {
  if (o.turntable_deg) return "--turntable";
  if (o.spacing_deg) return "--spacing-deg";
  if (!o.elevations_deg.empty()) return "--elevations-deg";
  if (!o.max_edge_px.empty()) return "--max-edge-px";
  return o.stop_when_complete ? "--stop-when-complete" : nullptr;
}

}  // namespace

Status CaptureOptions::validate() const {
  if (session.empty()) return wrong("session", "empty", "name the session's folder");
  constexpr double longest_s = 1e7;  // four months
  if (!(seconds >= 0 && seconds <= longest_s))
    return wrong("--seconds", text(seconds), "give 0 (until it is stopped) to 10000000");
  if (spacing_deg && !(*spacing_deg >= 1 && *spacing_deg <= 120))
    return wrong("--spacing-deg", text(*spacing_deg), "give 1 to 120, a divisor of 360");
  if (turntable_deg && !(*turntable_deg != 0 && std::abs(*turntable_deg) <= 120)) {
    return wrong("--turntable", text(*turntable_deg),
                 "give the table's step, -120 to 120 and not 0; leave it out without a turntable");
  }
  for (const double px : max_edge_px) {
    if (!(px > 0 && px <= 100))
      return wrong("--max-edge-px", text(px), "give more than 0, at most 100");
  }
  for (const double elevation : elevations_deg) {
    if (!(elevation > -90 && elevation < 90))
      return wrong("--elevations-deg", text(elevation),
                   "give -90 to 90, without the two themselves");
  }
  if (!token.empty() && page.empty())
    return wrong("--token", "given without --page", "name the page's port with --page");
  if (const char* option = option_for_guide(*this); option && guide == "off")
    return wrong(option, "given with --guide off", "leave one of them out");
  if (!driver.empty() && !visible.empty() && !thermal.empty())
    return wrong("--driver", driver, "leave it out: --visible and --thermal name both cameras");
  return {};
}

Result<recording::Cameras> cameras_of(const CaptureOptions& o) {
  std::error_code error;
  if (!o.profiles.empty() && !std::filesystem::is_directory(o.profiles, error))
    return fail(ErrorKind::input, "--profiles " + o.profiles, "no such folder",
                "name a folder of camera profiles");
  recording::Cameras cameras;
  bool any_profile = false;
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const std::string& own = modality == Modality::visible ? o.visible : o.thermal;
    const std::string& text = own.empty() ? o.driver : own;
    if (text.empty()) continue;
    ORBITFUSE_ASSIGN(const recording::CameraSpec spec, recording::parse_camera_spec(text));
    ORBITFUSE_TRY(check_watched(spec, o.session));
    any_profile = any_profile || spec.driver == "aravis";
    ORBITFUSE_TRY(recording::add_cameras(spec, modality, o.profiles, cameras));
  }
  if (cameras.sources.empty()) {
    return fail(ErrorKind::usage, "cameras", "none named",
                "give --visible, --thermal or --driver (orbitfuse devices lists them)");
  }
  ORBITFUSE_TRY(
      check_needs({{"--profiles", !o.profiles.empty(), "a camera of aravis", any_profile}}));
  return cameras;
}

Result<std::optional<LiveGuideOptions>> guide_of(const CaptureOptions& o,
                                                 const recording::Cameras& cameras) {
  if (o.guide == "off") return std::optional<LiveGuideOptions>{};
  if (!cameras.live && (o.guide == "key" || o.turntable_deg)) {
    return wrong(
        o.guide == "key" ? "--guide key" : "--turntable",
        "replayed and synthetic frames don't wait for a key",
        "leave it out: their stations come with the frames, or from the mat that they show");
  }
  LiveGuideOptions guide;
  if (cameras.plan) guide.plan = *cameras.plan;
  if (o.spacing_deg) guide.plan.spacing_deg = *o.spacing_deg;
  guide.plan.azimuth_tolerance_deg =
      std::min(guide.plan.azimuth_tolerance_deg, guide.plan.spacing_deg / 2);
  guide.turntable_step_deg = o.turntable_deg;
  guide.stations_come_with_frames = cameras.stations && !cameras.live;
  if (!o.max_edge_px.empty()) {
    guide.coverage.max_visible_edge_px = o.max_edge_px[0];
    guide.coverage.max_thermal_edge_px = o.max_edge_px[1];
  }
  if (!o.elevations_deg.empty()) guide.plan.loop_elevations_deg = o.elevations_deg;
  std::set<Modality> modalities;
  for (const auto& source : cameras.sources) modalities.insert(source->describe().modality);
  guide.plan.modalities.assign(modalities.begin(), modalities.end());
  ORBITFUSE_TRY(guide.validate());
  return std::optional<LiveGuideOptions>(guide);
}

Result<PositionFinder> finder_of(const CaptureOptions& o, const recording::Cameras& cameras) {
  if (!looks_for_mat(o, cameras)) {
    const char* given = o.mat_tags ? "--mat-tags" : o.mat ? "--mat" : nullptr;
    if (given) {
      return wrong(given, "no mat is looked for",
                   cameras.stations ? "leave it out: the frames carry their stations"
                                    : "leave it out, or use --guide auto without --turntable");
    }
    return PositionFinder{};
  }
  MatDesign design = o.mat == "foil" ? MatDesign::for_thermal(0.6) : MatDesign{};
  if (o.mat_tags) design.tags_per_side = *o.mat_tags;
  ORBITFUSE_TRY(design.validate().map_error([](Error error) {
    return as_typed(std::move(error), {{"mat.tags_per_side", "--mat-tags"}});
  }));
  const auto mat = std::make_shared<MatFinder>(design);
  for (const auto& source : cameras.sources) {
    const DeviceInfo device = source->describe();
    if (device.lens.focal_px) mat->set_focal_px(device.modality, *device.lens.focal_px);
  }
  return PositionFinder(
      [mat](const cv::Mat& image, Modality modality) -> std::optional<OrbitPosition> {
        const std::optional<MatSighting> sighting = mat->find(image, modality);
        if (!sighting) return std::nullopt;
        return sighting->position;
      });
}

Result<PageOptions> page_of(const CaptureOptions& o) {
  return page_options_of("--page", o.page, o.token).map_error(as_typed_page);
}

void add_capture_options(CLI::App& app, CaptureOptions& options) {
  app.add_option("session", options.session,
                 "Session folder: new, or with --resume one to go on with")
      ->required();
  app.add_option(
      "--visible", options.visible,
      "Visible camera: DRIVER[:CAMERA][,KEY=VALUE]...; drivers are aravis (GigE Vision), v4l2 "
      "(USB video), network (network:http://PHONE:8080/video, or rtsp:), stills (stills:FOLDER "
      "takes photos that arrive there), replay and synthetic");
  app.add_option("--thermal", options.thermal,
                 "Thermal camera, written alike, e.g. aravis:192.168.1.20 or stills:FOLDER for "
                 "radiometric JPEGs");
  app.add_option("--driver", options.driver,
                 "For modalities without a camera of their own, e.g. replay:FOLDER");
  app.add_option("--profiles", options.profiles,
                 "Folder of camera profiles instead of the shipped one");
  app.add_option("--seconds", options.seconds, "Stop by itself after this long; 0 = go on");
  app.add_flag("--stop-when-complete", options.stop_when_complete,
               "Stop by itself when every station is done");
  app.add_option("--guide", options.guide,
                 "auto: stations that the frames carry, else the mat; key: only the operator's "
                 "Enter key says where; off: record without stations")
      ->check(CLI::IsMember({"auto", "key", "off"}))
      ->capture_default_str();
  app.add_option(
      "--turntable", options.turntable_deg,
      "The object stands on a turntable: each Enter key (without keys: each photo of a "
      "stills camera) is this many degrees further; a full turn later it is the next loop");
  app.add_option("--mat", options.mat, "The mat that lies there (orbitfuse mat): paper or foil")
      ->check(CLI::IsMember({"paper", "foil"}))
      ->default_str("paper");
  app.add_option("--mat-tags", options.mat_tags,
                 "Tags along a side of the mat, if not the default");
  app.add_option(
      "--page", options.page,
      "Serve the capture page at PORT or HOST:PORT; beyond this machine it needs a token");
  app.add_option("--token", options.token, "Token of the page instead of a random one");
  app.add_flag("--wait-for-start", options.wait_for_start,
               "Begin when start is pressed on the page")
      ->needs("--page");
  app.add_flag("--view", options.view, "Show the state as text, once a second");
  app.add_option("--spacing-deg", options.spacing_deg,
                 "Azimuth between stations; 30 if nothing else is known");
  app.add_option("--elevations-deg", options.elevations_deg,
                 "Elevation of each loop; 10 30 55 if nothing else is known");
  app.add_option("--max-edge-px", options.max_edge_px,
                 "VISIBLE THERMAL: edges blurred wider than this (Gaussian sigma, with 640 pixels "
                 "along the longer side) are no station; 1.75 3.2 if not given")
      ->expected(2);
  // A shell's unset variable must not silently leave a camera or the page out.
  const CLI::Validator named(
      [](const std::string& given) {
        return std::string(given.empty() ? "given without a name" : "");
      },
      "", "");
  for (const char* option :
       {"--visible", "--thermal", "--driver", "--page", "--profiles", "--token"})
    app.get_option(option)->check(named);
}

}  // namespace orbitfuse::cli
