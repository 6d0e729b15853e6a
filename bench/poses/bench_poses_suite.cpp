// SPDX-License-Identifier: BSD-3-Clause
// bench_poses_suite [RUNS] [--scenes A,B] [--perturbations A,B] [--json FILE] [--views] [--list]
// Thermal poses of every scene under everything that recordings suffer from, against the truth:
// posed, errors in the visible frame, views that are sure and wrong, right views doubted or
// dropped, CPU seconds. RUNS (default ../runs) holds a session and a run folder for each scene;
// those that are missing are made with the program beside this one (import, train --modality
// visible). A scene with a / in its name is a folder with visible/, thermal/, ground_truth.json.
#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>

#include "bench/poses/perturbation.hpp"
#include "core/formats/colmap_model.hpp"
#include "core/system/clock.hpp"
#include "core/system/cpu.hpp"
#include "core/system/parallel.hpp"
#include "core/system/process.hpp"
#include "recon/assembly/field_renderer.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace orbitfuse;
namespace fs = std::filesystem;
using nlohmann::json;

/// A sure view must be this near the truth, in % of the extent and degrees.
constexpr double right_percent = 2, right_deg = 2;

struct Arguments {
  fs::path runs = fs::path(ORBITFUSE_SOURCE_DIR).parent_path() / "runs", program, json_file;
  std::set<std::string> scenes, perturbations;
  bool views = false;
};

std::set<std::string> words(const std::string& list) {
  std::set<std::string> set;
  std::istringstream stream(list);
  for (std::string word; std::getline(stream, word, ',');) set.insert(word);
  return set;
}

/// Nothing where a word is not understood: an option taken for RUNS would be a folder of that name.
std::optional<Arguments> arguments_of(int argc, char** argv) {
  Arguments arguments;
  arguments.program = fs::path(argv[0]).parent_path() / "../../app/orbitfuse";
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--views")
      arguments.views = true;
    else if (word == "--scenes" && i + 1 < argc)
      arguments.scenes = words(argv[++i]);
    else if (word == "--perturbations" && i + 1 < argc)
      arguments.perturbations = words(argv[++i]);
    else if (word == "--json" && i + 1 < argc)
      arguments.json_file = argv[++i];
    else if (!word.starts_with('-'))
      arguments.runs = word;
    else
      return std::nullopt;
  }
  std::set<std::string> known = {"all"};
  for (const scenes::Perturbation& one : scenes::perturbations()) known.insert(one.name);
  for (const std::string& name : arguments.perturbations)
    if (!known.contains(name)) return std::nullopt;
  return arguments;
}

struct SceneFolders {
  std::string name;
  fs::path session, run, truth;
};

std::vector<SceneFolders> scene_folders(const Arguments& arguments) {
  std::vector<SceneFolders> list;
  const fs::path orbits = testing::shared_data() / "orbits";
  for (const char* name : {"container", "sedan", "van", "transformer", "hut", "statue"})
    list.push_back({name, arguments.runs / name / "session", arguments.runs / name / "run",
                    orbits / name / "ground_truth.json"});
  const fs::path car = fs::path(ORBITFUSE_SOURCE_DIR) / "replay_data/car";
  list.push_back({"car", car, arguments.runs / "car/run", car / "ground_truth.json"});
  // Scenes of one's own, as ../shared/scenes renders and exports them.
  for (const std::string& scene : arguments.scenes) {
    const std::string name = fs::path(scene).filename();
    if (scene.find('/') != std::string::npos)
      list.push_back({name, arguments.runs / name / "session", arguments.runs / name / "run",
                      fs::path(scene) / "ground_truth.json"});
  }
  std::erase_if(list, [&](const SceneFolders& scene) {
    return !fs::exists(scene.truth) ||
           (!arguments.scenes.empty() && !arguments.scenes.contains(scene.name) &&
            !arguments.scenes.contains(scene.truth.parent_path().string()));
  });
  return list;
}

/// The session and the visible half of the run, where they are not there yet.
Status prepare(const Arguments& arguments, const SceneFolders& scene) {
  const auto call = [&](std::vector<std::string> command) -> Status {
    command.insert(command.begin(), arguments.program.string());
    fs::create_directories(arguments.runs / scene.name);
    ORBITFUSE_ASSIGN(const int status,
                     run_process(command, arguments.runs / scene.name / "log.txt", "bench", {}));
    if (status == 0) return {};
    return fail(ErrorKind::quality, scene.name, fmt::format("{} ends with {}", command[1], status),
                "see log.txt in its folder");
  };
  const fs::path data = scene.truth.parent_path();
  if (!fs::exists(scene.session / "manifest.jsonl"))
    ORBITFUSE_TRY(
        call({"import", scene.session.string(), "--visible", (data / "visible").string(),
              "--thermal", (data / "thermal").string(), "--ground-truth", scene.truth.string(),
              "--priors-only", "--station-spacing-deg", "30", "--loops", "2"}));
  if (!fs::exists(scene.run / "train_visible/field.bin"))
    ORBITFUSE_TRY(call(
        {"train", scene.session.string(), "--out", scene.run.string(), "--modality", "visible"}));
  return {};
}

/// One row of the table.
struct Row {
  std::string scene, perturbation, failure;
  int posed = 0, total = 0, sure = 0, wrong_but_sure = 0, needlessly_doubted = 0, dropped = 0;
  PoseError error;
  double cpu_s = 0, focal_percent = 0;
  double rendering_s = 0, rays = 0;  ///< CPU, millions
};

void judge(const ThermalPoses& poses, const Reconstruction& visible, const scenes::Scene& scene,
           Row& row) {
  row.posed = static_cast<int>(poses.reconstruction.views.size());
  row.total = poses.frame_count;
  row.dropped = static_cast<int>(poses.dropped.size());
  row.error =
      scenes::pose_error(poses.reconstruction,
                         poses.shares_visible_frame ? visible : poses.reconstruction, scene.truth);
  if (row.error.views == 0) row.failure = "no similarity to the truth: nothing can be measured";
  std::set<std::string> doubtful;
  for (const DoubtfulView& view : poses.doubtful) doubtful.insert(view.name);
  for (const ViewError& view : row.error.each) {
    const bool sure = !doubtful.contains(view.name);
    const bool right = view.center_percent <= right_percent && view.rotation_deg <= right_deg;
    row.sure += sure ? 1 : 0;
    row.wrong_but_sure += sure && !right ? 1 : 0;
    row.needlessly_doubted += !sure && right ? 1 : 0;
  }
  if (poses.reconstruction.views.empty()) return;
  const PosedView& first = poses.reconstruction.views.front();
  row.focal_percent = 100 * (first.camera.fx / scene.truth.views.at(first.name).camera.fx - 1);
}

Row measured(const SceneFolders& folders, const scenes::Perturbation& by,
             const Arguments& arguments, const nerf::Field& field, const Reconstruction& visible) {
  Row row;
  row.scene = folders.name, row.perturbation = by.name;
  auto scene = scenes::run_scene(folders.session, folders.truth);
  const test::TempFolder work;
  const Status perturbed =
      scene ? scenes::perturb(*scene, by, work.path()) : Status(tl::unexpected(scene.error()));
  if (!perturbed) {
    row.failure = perturbed.error().message();
    return row;
  }
  if (by.tracking) scenes::add_tracking(*scene, folders.truth.parent_path() / "tracking.json");
  Progress progress;
  const double before = cpu_seconds();
  if (arguments.views)
    progress.report = [before, &row](const ProgressEvent& e) {
      fmt::print("  {:5.1f} CPU s, {:.1f} M rays: {}\n", cpu_seconds() - before, row.rays,
                 e.detail);
    };
  const SceneRenderer renderer = edge_renderer(field, progress);
  const VisibleScene seen{visible, [&](const Camera& camera, const Rigid3d& pose) {
                            const double start = cpu_seconds();
                            auto render = renderer(camera, pose);
                            row.rendering_s += cpu_seconds() - start;
                            row.rays += 1e-6 * camera.width * camera.height;
                            return render;
                          }};
  PoseOptions options;
  options.use_known_poses = false;
  const auto poses =
      estimate_thermal_poses(scene->session, &seen, options, work / "poses", progress);
  row.cpu_s = cpu_seconds() - before;
  if (poses)
    judge(*poses, visible, *scene, row);
  else
    row.failure = poses.error().found;
  if (arguments.views && poses) {
    for (const LadderStep& step : poses->ladder) fmt::print("  {}: {}\n", step.attempt, step.why);
    for (const DroppedView& view : poses->dropped)
      fmt::print("  dropped {}: {}\n", view.name, view.why);
    for (const DoubtfulView& view : poses->doubtful)
      fmt::print("  doubtful {}: {}, {}\n", view.name, name(view.reason), view.why);
    for (const ViewError& view : row.error.each)
      fmt::print("  {} centre {:.2f} %, outwards {:+.2f} %, rotation {:.2f} deg\n", view.name,
                 view.center_percent, view.outward_percent, view.rotation_deg);
  }
  return row;
}

void print(const Row& row) {
  if (!row.failure.empty()) {
    fmt::print("| {} | {} | none: {} | | | | | | {:.0f} |\n", row.scene, row.perturbation,
               row.failure.substr(0, 300), row.cpu_s);
    return;
  }
  fmt::print(
      "| {} | {} | {}/{} | {:.2f} / {:.2f} / {:.2f} | {:.2f} / {:.2f} | {:+.2f} | {} | {} | {:.0f} "
      "({:.0f}, {:.1f} M) |\n",
      row.scene, row.perturbation, row.posed, row.total, row.error.ate_percent,
      row.error.ate_median_percent, row.error.ate_max_percent, row.error.rotation_mean_deg,
      row.error.rotation_max_deg, row.focal_percent, row.wrong_but_sure,
      row.needlessly_doubted + row.dropped, row.cpu_s, row.rendering_s, row.rays);
}

json json_of(const Row& row) {
  return {{"scene", row.scene},
          {"perturbation", row.perturbation},
          {"failure", row.failure},
          {"posed", row.posed},
          {"total", row.total},
          {"sure", row.sure},
          {"wrong_but_sure", row.wrong_but_sure},
          {"needlessly_doubted", row.needlessly_doubted},
          {"dropped", row.dropped},
          {"centres_rms_percent", row.error.ate_percent},
          {"centres_median_percent", row.error.ate_median_percent},
          {"centres_worst_percent", row.error.ate_max_percent},
          {"rotation_mean_deg", row.error.rotation_mean_deg},
          {"rotation_worst_deg", row.error.rotation_max_deg},
          {"focal_percent", row.focal_percent},
          {"cpu_s", row.cpu_s},
          {"rendering_cpu_s", row.rendering_s},
          {"rays_millions", row.rays}};
}

Status run_scene(const SceneFolders& folders, const Arguments& arguments, json& rows) {
  ORBITFUSE_TRY(prepare(arguments, folders));
  ORBITFUSE_ASSIGN(const Reconstruction visible,
                   read_colmap_model(folders.run / "poses_visible/model", Modality::visible));
  ORBITFUSE_ASSIGN(const nerf::Field field,
                   nerf::Field::load(folders.run / "train_visible/field.bin"));
  for (const scenes::Perturbation& by : scenes::perturbations()) {
    const bool wanted =
        arguments.perturbations.empty()
            ? by.name == "default"
            : arguments.perturbations.contains(by.name) || arguments.perturbations.contains("all");
    if (!wanted) continue;
    if (by.tracking && !fs::exists(folders.truth.parent_path() / "tracking.json")) continue;
    const Row row = measured(folders, by, arguments, field, visible);
    print(row);
    rows.push_back(json_of(row));
    if (!arguments.json_file.empty()) std::ofstream(arguments.json_file) << rows.dump(1) << "\n";
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const std::optional<Arguments> asked = arguments_of(argc, argv);
  if (!asked) {
    fmt::print(stderr,
               "bench_poses_suite [RUNS] [--scenes A,B] [--perturbations A,B|all] [--views] "
               "[--json FILE]\nperturbations:");
    for (const scenes::Perturbation& one : scenes::perturbations())
      fmt::print(stderr, " {}", one.name);
    fmt::print(stderr, "\n");
    return 2;
  }
  const Arguments& arguments = *asked;
  fmt::print("{}; {} threads\n\n", cpu_description(), thread_count());
  fmt::print(
      "| scene | perturbation | posed | centres RMS / median / worst, % | rotation mean / worst, "
      "deg "
      "| focal, % | sure but wrong | right, yet doubted, or dropped | CPU s (renders, rays) |\n"
      "|---|---|---|---|---|---|---|---|---|\n");
  json rows = json::array();
  bool all_measured = true;
  for (const SceneFolders& scene : scene_folders(arguments)) {
    const Status done = run_scene(scene, arguments, rows);
    all_measured = all_measured && done;
    if (!done) fmt::print("| {} | | {} | | | | | | |\n", scene.name, done.error().message());
  }
  return all_measured ? 0 : 1;
}
