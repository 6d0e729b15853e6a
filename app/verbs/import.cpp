// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "app/cli/option_pairs.hpp"
#include "app/cli/typed_options.hpp"
#include "app/cli/verb.hpp"
#include "app/pipeline/out_folder.hpp"
#include "core/temperature.hpp"
#include "drivers/stills/import.hpp"

namespace orbitfuse::cli {
namespace {

struct ImportArguments {
  std::string session;
  ImportOptions import;
  std::string scale = "auto";
  std::optional<double> kelvin_per_count, kelvin_offset;
  std::optional<double> reflected_c, air_c, humidity_percent;
  std::optional<double> spacing_deg;
  std::optional<int> loops;
  std::vector<double> elevations_deg;
  bool video_frames_given = false;
};

const std::vector<std::pair<std::string, ThermalScale>> scales = {
    {"auto", ThermalScale::automatic},
    {"centikelvin", ThermalScale::centikelvin},
    {"linear", ThermalScale::linear},
    {"raw", ThermalScale::raw_counts},
};

void add_sources(CLI::App& app, ImportArguments& o) {
  constexpr const char* group = "Sources";
  app.add_option("--visible", o.import.visible,
                 "Photos (JPEG, PNG, TIFF, HEIC) and videos of an orbit: folders or files")
      ->group(group);
  app.add_option("--video-frames", o.import.video.max_frames,
                 "Take at most this many frames of a video, the sharpest along the way")
      ->capture_default_str()
      ->group(group);
  app.add_option("--thermal", o.import.thermal,
                 "Radiometric JPEG, 16-bit TIFF or PNG, 8-bit images: folders or files")
      ->group(group);
  app.add_option("--visible-tracking", o.import.visible_tracking, "Photos taken between stations")
      ->group(group);
  app.add_option("--thermal-tracking", o.import.thermal_tracking, "Thermal frames between stations")
      ->group(group);
  app.add_flag("--embedded-visible", o.import.embedded_visible,
               "Also take the photos embedded in radiometric JPEGs")
      ->group(group);
  app.add_flag("--rig", o.import.rig,
               "Images of equal name (but for a word) or time were shot at once by one device")
      ->group(group);
}

void add_poses_known(CLI::App& app, ImportArguments& o) {
  constexpr const char* group = "Known poses and stations";
  app.add_option("--transforms", o.import.transforms_json, "nerfstudio transforms.json")
      ->group(group);
  app.add_option("--visible-colmap", o.import.visible_colmap, "COLMAP model of the photos")
      ->group(group);
  app.add_option("--thermal-colmap", o.import.thermal_colmap, "COLMAP model of the thermal frames")
      ->group(group);
  app.add_option("--ground-truth", o.import.ground_truth, "Exact poses (docs/formats.md)")
      ->group(group);
  app.add_flag("--priors-only", o.import.ground_truth_priors_only,
               "Of --ground-truth take focal lengths and elevations, not the poses")
      ->group(group);
  app.add_option("--station-spacing-deg", o.spacing_deg,
                 "The frames were taken in order at stations this far apart")
      ->group(group);
  app.add_option("--loops", o.loops, "Loops of stations in each modality")->group(group);
  app.add_option("--elevations-deg", o.elevations_deg, "Elevation of each loop, if known")
      ->group(group);
  app.add_option("--visible-focal-px", o.import.visible_focal_px, "Where the files name none")
      ->group(group);
  app.add_option("--thermal-focal-px", o.import.thermal_focal_px, "Where the files name none")
      ->group(group);
}

void add_radiometry(CLI::App& app, ImportArguments& o) {
  constexpr const char* group = "Radiometry";
  std::vector<std::string> words;
  for (const auto& [word, scale] : scales) words.push_back(word);
  app.add_option("--thermal-scale", o.scale, "How samples become temperatures")
      ->check(CLI::IsMember(words))
      ->capture_default_str()
      ->group(group);
  app.add_option("--kelvin-per-count", o.kelvin_per_count, "For --thermal-scale linear")
      ->group(group);
  app.add_option("--kelvin-offset", o.kelvin_offset, "For --thermal-scale linear")->group(group);
  app.add_option("--emissivity", o.import.object.emissivity, "Instead of the files' own")
      ->group(group);
  app.add_option("--distance-m", o.import.object.distance_m, "Instead of the files' own")
      ->group(group);
  app.add_option("--reflected-c", o.reflected_c, "Reflected temperature")->group(group);
  app.add_option("--air-c", o.air_c, "Air temperature")->group(group);
  app.add_option("--humidity", o.humidity_percent, "Relative humidity in percent")->group(group);
}

Status check_ranges(const ImportArguments& o) {
  for (const double elevation : o.elevations_deg)
    ORBITFUSE_TRY(check_typed({{"--elevations-deg", elevation, from_to(-90, 90)}}));
  const std::size_t loops = static_cast<std::size_t>(std::max(1, o.loops.value_or(1)));
  if (!o.elevations_deg.empty() && o.elevations_deg.size() != loops)
    return fail(ErrorKind::usage, "--elevations-deg",
                fmt::format("{} given, for {} loops", o.elevations_deg.size(), loops),
                "give one for each of --loops, or none");
  return check_typed({{"--humidity", o.humidity_percent, humidity_percent_range},
                      {"--reflected-c", o.reflected_c, reflected_c_range},
                      {"--air-c", o.air_c, air_c_range},
                      {"--emissivity", o.import.object.emissivity, emissivity_range},
                      {"--distance-m", o.import.object.distance_m, distance_m_range},
                      {"--station-spacing-deg", o.spacing_deg, from_to(1, 180)},
                      {"--loops", o.loops, from_to(1, 100)},
                      {"--kelvin-per-count", o.kelvin_per_count, above_up_to(0, 10)},
                      {"--kelvin-offset", o.kelvin_offset, from_to(-10000, 10000)},
                      {"--video-frames", o.import.video.max_frames, from_to(2, 5000)},
                      {"--visible-focal-px", o.import.visible_focal_px, from_to(1, 1e6)},
                      {"--thermal-focal-px", o.import.thermal_focal_px, from_to(1, 1e6)}});
}

/// Temperatures and percentages of the command line in the units of the library.
void resolve(ImportArguments& o) {
  for (const auto& [word, scale] : scales)
    if (word == o.scale) o.import.thermal_scale = scale;
  if (o.kelvin_per_count) o.import.kelvin_per_count = *o.kelvin_per_count;
  if (o.kelvin_offset) o.import.kelvin_offset = *o.kelvin_offset;
  if (o.reflected_c) o.import.object.reflected_temperature_k = kelvin_from_celsius(*o.reflected_c);
  if (o.air_c) o.import.object.atmospheric_temperature_k = kelvin_from_celsius(*o.air_c);
  if (o.humidity_percent) o.import.object.relative_humidity = *o.humidity_percent / 100;
  if (o.spacing_deg) {
    DeclaredStations stations;
    stations.spacing_deg = *o.spacing_deg;
    stations.loops = o.loops.value_or(1);
    stations.elevations_deg = o.elevations_deg;
    o.import.visible_stations = o.import.thermal_stations = stations;
  }
}

/// Options that only mean something with another one.
Status check_alone(const ImportArguments& o) {
  const ImportOptions& i = o.import;
  const bool linear = o.scale == "linear", poses_name_images = i.transforms_json.has_value();
  const bool visible = !i.visible.empty() || !i.visible_tracking.empty() || i.embedded_visible ||
                       poses_name_images,
             thermal = !i.thermal.empty() || !i.thermal_tracking.empty() || poses_name_images;
  return check_needs({
      {"--loops", o.loops.has_value(), "--station-spacing-deg", o.spacing_deg.has_value()},
      {"--elevations-deg", !o.elevations_deg.empty(), "--station-spacing-deg",
       o.spacing_deg.has_value()},
      {"--kelvin-per-count", o.kelvin_per_count.has_value(), "--thermal-scale linear", linear},
      {"--kelvin-offset", o.kelvin_offset.has_value(), "--thermal-scale linear", linear},
      {"--thermal-scale", o.scale != "auto", "--thermal", thermal},
      {"--thermal-scale linear", linear, "--kelvin-per-count", o.kelvin_per_count.has_value()},
      {"--embedded-visible", i.embedded_visible, "--thermal", !i.thermal.empty()},
      {"--priors-only", i.ground_truth_priors_only, "--ground-truth", i.ground_truth.has_value()},
      {"--visible-colmap", i.visible_colmap.has_value(), "--visible", visible},
      {"--thermal-colmap", i.thermal_colmap.has_value(), "--thermal", thermal},
      {"--visible-focal-px", i.visible_focal_px.has_value(), "--visible", visible},
      {"--thermal-focal-px", i.thermal_focal_px.has_value(), "--thermal", thermal},
      {"--rig", i.rig, "--visible and --thermal", visible && thermal},
      {"--video-frames", o.video_frames_given, "--visible", visible},
  });
}

/// A folder of its own for each session: "car_out" beside "car/".
std::string out_beside(const std::string& session) {
  const std::filesystem::path folder =
      session.find_first_not_of("./") == std::string::npos
          ? std::filesystem::absolute(session).lexically_normal()  // "." has no name to add to
          : std::filesystem::path(session).lexically_normal();
  const std::filesystem::path last = folder.has_filename() ? folder : folder.parent_path();
  return last.string() + "_out";
}

Status run(Context& context, ImportArguments& o) {
  ORBITFUSE_TRY(check_alone(o));
  ORBITFUSE_TRY(check_ranges(o));
  ORBITFUSE_TRY(pipeline::check_outside_stages(o.session));
  resolve(o);
  const bool dry = context.common.dry_run;
  ORBITFUSE_ASSIGN(const ImportReport report,
                   dry ? rehearse_import(o.import, o.session, context.progress)
                       : import_session(o.import, o.session, context.progress));
  for (const std::string& warning : report.warnings) context.console.warning(warning);
  for (const std::string& note : report.notes) context.console.info("note: " + note);
  context.console.data(
      fmt::format("{}{}: {} visible and {} thermal frames{}, {} tracking frames, {} with a pose, "
                  "{} with a station",
                  dry ? "would make " : "", o.session, report.visible, report.thermal,
                  report.thermal == 0       ? ""
                  : report.has_temperatures ? " with temperatures"
                                            : " without temperatures",
                  report.tracking, report.with_pose, report.with_station));
  context.console.info(
      dry ? "nothing was written"
          : fmt::format("next: orbitfuse run {} --out {}", o.session, out_beside(o.session)));
  context.result = {{"session", o.session},
                    {"visible", report.visible},
                    {"thermal", report.thermal},
                    {"tracking", report.tracking},
                    {"with_pose", report.with_pose},
                    {"with_station", report.with_station},
                    {"has_temperatures", report.has_temperatures},
                    {"kelvin_per_count", report.kelvin_per_count},
                    {"warnings", report.warnings},
                    {"notes", report.notes}};
  if (dry) context.result["dry_run"] = true;
  return {};
}

}  // namespace

Action add_import(CLI::App& app) {
  const auto options = std::make_shared<ImportArguments>();
  app.add_option("session", options->session, "New session folder")->required();
  add_sources(app, *options);
  add_poses_known(app, *options);
  add_radiometry(app, *options);
  return [options, &app](Context& context) {
    options->video_frames_given = app.count("--video-frames") > 0;
    return run(context, *options);
  };
}

}  // namespace orbitfuse::cli
