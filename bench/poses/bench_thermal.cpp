// SPDX-License-Identifier: BSD-3-Clause
// bench_thermal SESSION RUN GROUND_TRUTH [--tracking TRACKING_JSON]
// [--focal-error RELATIVE] [--mirrored] [--turned QUARTERS] [--views] [--attempts]
// The thermal pose stage alone, on what an earlier run left in its folder RUN (poses_visible,
// train_visible), so that one stage can be judged without the others. GROUND_TRUTH serves the
// comparison only. --tracking adds frames recorded between the stations, --focal-error 0.03 makes
// the thermal focal length known 3 % too long, --mirrored turns the thermal images round left to
// right, --turned 2 as if the camera had been held upside down (1, 3: on its side), --views prints
// each view, --attempts sets what COLMAP, the scene's lines and its renders give alone beside each
// other, with their time.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "bench/poses/misalignment.hpp"
#include "core/formats/colmap_model.hpp"
#include "core/geometry/quarter_turn.hpp"
#include "core/image/image_io.hpp"
#include "core/numeric/median.hpp"
#include "core/system/clock.hpp"
#include "core/system/cpu.hpp"
#include "core/system/parallel.hpp"
#include "recon/assembly/field_renderer.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "tests/support/orbit_scenes.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace orbitfuse;
namespace fs = std::filesystem;

struct Arguments {
  fs::path session, run, truth, tracking;
  double focal_error = 0;
  bool views = false, attempts = false, mirrored = false;
  QuarterTurn turned;
};

Arguments arguments_of(int argc, char** argv) {
  Arguments arguments;
  std::vector<std::string> places;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--views") {
      arguments.views = true;
    } else if (word == "--attempts") {
      arguments.attempts = true;
    } else if (word == "--tracking" && i + 1 < argc) {
      arguments.tracking = argv[++i];
    } else if (word == "--mirrored") {
      arguments.mirrored = true;
    } else if (word == "--turned" && i + 1 < argc) {
      arguments.turned.clockwise = std::atoi(argv[++i]) & 3;
    } else if (word == "--focal-error" && i + 1 < argc) {
      arguments.focal_error = std::strtod(argv[++i], nullptr);
    } else {
      places.emplace_back(word);
    }
  }
  if (places.size() == 3)
    arguments.session = places[0], arguments.run = places[1], arguments.truth = places[2];
  return arguments;
}

/// One attempt of the ladder alone: its success and error against its time.
void print_attempt(const char* name, const scenes::Scene& scene, const VisibleScene* seen,
                   const PoseOptions& options) {
  const test::TempFolder work;
  const double before = cpu_seconds();
  const auto poses = estimate_thermal_poses(scene.session, seen, options, work.path(), {});
  const double spent = cpu_seconds() - before;
  if (!poses) {
    fmt::print("| {} | none: {} | | | {:.0f} |\n", name, poses.error().found.substr(0, 120), spent);
    return;
  }
  const PoseError error = scenes::pose_error(
      poses->reconstruction,
      poses->shares_visible_frame ? seen->reconstruction : poses->reconstruction, scene.truth);
  if (error.views == 0) {
    fmt::print("| {} | no similarity to the truth: nothing can be measured |\n", name);
    return;
  }
  fmt::print("| {} | {}/{} | {:.2f} / {:.2f} | {:.2f} / {:.2f} | {:.0f} |\n", name,
             poses->reconstruction.views.size(), poses->frame_count, error.ate_percent,
             error.ate_max_percent, error.rotation_mean_deg, error.rotation_max_deg, spent);
}

void print_attempts(const scenes::Scene& scene, const VisibleScene& seen,
                    const PoseOptions& options) {
  fmt::print(
      "| attempt alone | posed | centres RMS / worst, % | rotation mean / worst, deg | CPU s |\n"
      "|---|---|---|---|---|\n");
  print_attempt("COLMAP on the thermal views", scene, nullptr, options);
  print_attempt("lines, then renders and temperatures", scene, &seen, options);
}

/// The session in another folder, its thermal images mirrored left to right, then turned.
Status turn_thermal(const fs::path& folder, const Arguments& arguments, Session& session) {
  for (FrameRecord& frame : session.frames) {
    std::error_code ignored;
    fs::create_directories((folder / frame.file).parent_path(), ignored);
    if (frame.modality == Modality::visible) {
      fs::create_symlink(fs::absolute(session.folder / frame.file), folder / frame.file, ignored);
      continue;
    }
    ORBITFUSE_ASSIGN(cv::Mat kelvin, read_thermal_k(session.folder / frame.file));
    if (arguments.mirrored) cv::flip(kelvin, kelvin, 1);
    kelvin = upright(arguments.turned, kelvin);
    frame.width = kelvin.cols, frame.height = kelvin.rows;
    ORBITFUSE_TRY(write_thermal_tiff(folder / frame.file, kelvin));
  }
  session.folder = folder;
  return {};
}

/// Poses of the images as they were before they were turned.
Reconstruction turned_back(QuarterTurn turned, Reconstruction poses) {
  for (PosedView& view : poses.views) view = as_taken(turned, view);
  return poses;
}

Status run(const Arguments& arguments) {
  ORBITFUSE_ASSIGN(scenes::Scene scene, scenes::run_scene(arguments.session, arguments.truth));
  const test::TempFolder other;
  if (arguments.mirrored || arguments.turned.clockwise != 0)
    ORBITFUSE_TRY(turn_thermal(other.path(), arguments, scene.session));
  if (!arguments.tracking.empty()) scenes::add_tracking(scene, arguments.tracking);
  for (DeviceInfo& device : scene.session.devices)
    if (device.modality == Modality::thermal && device.lens.focal_px)
      *device.lens.focal_px *= 1 + arguments.focal_error;
  ORBITFUSE_ASSIGN(Reconstruction visible,
                   read_colmap_model(arguments.run / "poses_visible/model", Modality::visible));
  ORBITFUSE_ASSIGN(const nerf::Field field,
                   nerf::Field::load(arguments.run / "train_visible/field.bin"));
  Progress progress;
  double rendering_s = 0;
  int renders = 0;
  const SceneRenderer rendered = edge_renderer(field, progress);
  VisibleScene seen{std::move(visible), [&](const Camera& camera, const Rigid3d& pose) {
                      const double before = cpu_seconds();
                      auto view = rendered(camera, pose);
                      rendering_s += cpu_seconds() - before, ++renders;
                      return view;
                    }};
  fmt::print("{}; {} threads\n", cpu_description(), thread_count());
  const double before = cpu_seconds();
  if (arguments.views)
    progress.report = [&](const ProgressEvent& e) {
      fmt::print("after {:.1f} CPU s: {}\n", cpu_seconds() - before, e.detail);
    };
  const auto start = std::chrono::steady_clock::now();
  PoseOptions options;
  options.use_known_poses = false;
  if (arguments.attempts) {
    print_attempts(scene, seen, options);
    return {};
  }
  const test::TempFolder work;
  ORBITFUSE_ASSIGN(const ThermalPoses poses,
                   estimate_thermal_poses(scene.session, &seen, options, work.path(), progress));
  const double wall =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const LadderStep& step : poses.ladder)
    fmt::print("{} {}: {}\n", step.held ? "held" : "fell", step.attempt, step.why);
  for (const DroppedView& view : poses.dropped) fmt::print("dropped {}: {}\n", view.name, view.why);
  for (const DoubtfulView& view : poses.doubtful)
    fmt::print("doubtful {}: {}\n", view.name, view.why);
  for (const auto& [gate, value] : poses.gates) fmt::print("{} = {:.4g}\n", gate, value);
  fmt::print("{}/{} posed, {:.1f} s, {:.1f} CPU s, {:.1f} of them in {} renders\n",
             poses.reconstruction.views.size(), poses.frame_count, wall, cpu_seconds() - before,
             rendering_s, renders);
  const Reconstruction thermal = turned_back(arguments.turned, poses.reconstruction);
  const PoseError error = scenes::pose_error(
      thermal, poses.shares_visible_frame ? seen.reconstruction : thermal, scene.truth);
  if (error.views == 0)
    return fail(ErrorKind::input, arguments.truth.string(),
                "no posed view of that name, or no similarity to the truth",
                "nothing can be measured: name the thermal files as the session does");
  fmt::print(
      "centres ATE {:.3f} %, median {:.3f} %, worst {:.3f} % of the extent; rotation mean "
      "{:.3f}, median {:.3f}, worst {:.3f} deg\n",
      error.ate_percent, error.ate_median_percent, error.ate_max_percent, error.rotation_mean_deg,
      error.rotation_median_deg, error.rotation_max_deg);
  ORBITFUSE_ASSIGN(scenes::Misalignment apart,
                   scenes::misalignment(scene, seen.reconstruction, thermal, seen.renderer));
  fmt::print(
      "rendered pairs of {} test views: median misalignment {:.2f} px at 640 wide, 90 % within "
      "{:.2f} px\n",
      scene.test.size(), median(apart.px), quantile(apart.px, 0.9));
  if (arguments.views)
    for (const ViewError& view : error.each)
      fmt::print("{} centre {:.2f} %, outwards {:+.2f} %, rotation {:.2f} deg\n", view.name,
                 view.center_percent, view.outward_percent, view.rotation_deg);
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const Arguments arguments = arguments_of(argc, argv);
  if (arguments.truth.empty()) {
    std::fputs(
        "bench_thermal SESSION RUN GROUND_TRUTH [--tracking TRACKING_JSON] [--focal-error "
        "RELATIVE] [--mirrored] [--turned QUARTERS] [--views] [--attempts]\n",
        stderr);
    return 2;
  }
  const Status done = run(arguments);
  if (!done) std::fprintf(stderr, "%s\n", done.error().message().c_str());
  return done ? 0 : 1;
}
