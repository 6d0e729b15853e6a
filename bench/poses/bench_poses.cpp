// SPDX-License-Identifier: BSD-3-Clause
// bench_poses SCENE [WORKDIR [--visible-truth]]: runs the pose ladder on a shared scene and prints
// success and error against run time per attempt. Scenes: container, tracking, fox,
// metu_cloudy_scene_7, metu_sunny_scene_7, arco, car (the session recorded in replay_data).

#include <fmt/format.h>
#include <cstdio>

#include "core/system/clock.hpp"
#include "core/system/cpu.hpp"
#include "core/system/parallel.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "tests/support/orbit_scenes.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace orbitfuse;

void print(const ModalityPoses& poses, const Reconstruction& anchor, const scenes::Truth& truth,
           double cpu_s) {
  for (const LadderStep& step : poses.ladder)
    fmt::print("  {} {}: {}/{} in {:.1f} s: {}\n", step.held ? "held " : "fell ", step.attempt,
               step.posed, step.total, step.seconds, step.why);
  for (const DroppedView& view : poses.dropped)
    fmt::print("  dropped {}: {}\n", view.name, view.why);
  for (const auto& [gate, value] : poses.gates) fmt::print("  {} = {:.4g}\n", gate, value);
  fmt::print("  posed {}/{}, {:.1f} CPU s, {:.2f} px\n", poses.reconstruction.views.size(),
             poses.frame_count, cpu_s, poses.reprojection_rms_px);
  const PoseError error = scenes::pose_error(poses.reconstruction, anchor, truth);
  if (error.views > 0)
    fmt::print(
        "  against the truth: ATE {:.3f} %, median {:.3f} %, worst {:.3f} % of the extent; "
        "rotation median {:.3f}, worst {:.3f} deg\n",
        error.ate_percent, error.ate_median_percent, error.ate_max_percent,
        error.rotation_median_deg, error.rotation_max_deg);
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // a run that is cut short keeps its first attempts
  const std::filesystem::path data = testing::shared_data();
  if (argc < 2 || !std::filesystem::exists(data)) {
    std::fputs(
        "bench_poses SCENE [WORKDIR [--visible-truth]]; needs the shared data (ORBITFUSE_SHARED)\n",
        stderr);
    return 2;
  }
  const std::string which = argv[1];
  const test::TempFolder temp;
  const std::filesystem::path workdir = argc > 2 ? argv[2] : temp.path();
  scenes::Scene scene;
  if (which == "container" || which == "tracking") {
    scenes::ContainerOptions options;
    options.tracking = which == "tracking";
    options.thermal_focal_error = 0.03;
    options.visible_focal_error = 0.03;
    scene = scenes::container_scene(data, options);
  } else if (which == "car") {
    scene = scenes::session_scene(std::filesystem::path(ORBITFUSE_SOURCE_DIR) / "replay_data/car");
  } else if (which == "fox") {
    scene = scenes::fox_scene(data);
  } else {
    scene = scenes::folder_scene(data / (which == "arco" ? "orbits" : "pairs") / which);
  }
  fmt::print("{}; {} threads\n", cpu_description(), thread_count());

  const PoseOptions options;
  Progress progress;
  double start = cpu_seconds();
  const bool from_truth = argc > 3 && std::string(argv[3]) == "--visible-truth";
  Result<ModalityPoses> visible = ModalityPoses{};
  if (from_truth) {
    for (const FrameRecord* frame : scene.session.frames_of(Modality::visible))
      visible->reconstruction.views.push_back(scene.truth.views.at(frame->file));
  } else {
    visible = estimate_visible_poses(scene.session, options, workdir, progress);
  }
  fmt::print("visible\n");
  VisibleScene seen;
  if (visible) {
    print(*visible, visible->reconstruction, scene.truth, cpu_seconds() - start);
    seen.reconstruction = visible->reconstruction;
  } else {
    fmt::print("  {}\n", visible.error().message());
  }
  if (scene.session.frames_of(Modality::thermal).empty()) return 0;
  start = cpu_seconds();
  const auto thermal =
      estimate_thermal_poses(scene.session, visible ? &seen : nullptr, options, workdir, progress);
  fmt::print("thermal\n");
  if (thermal) {
    print(*thermal, thermal->shares_visible_frame ? seen.reconstruction : thermal->reconstruction,
          scene.truth, cpu_seconds() - start);
  } else {
    fmt::print("  {}\n", thermal.error().message());
  }
  return 0;
}
