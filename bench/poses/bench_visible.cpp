// SPDX-License-Identifier: BSD-3-Clause
// bench_visible SCENE... [--focal-error R] [--no-stations] [--no-focal] [--colmap | --global]
// [--first N] [--views]: poses of the visible views alone, and their error where the truth is
// known; --views: of each view; --first: of an orbit cut off after N photos. A scene is one of
// shared data's orbits (container, sedan, van, fox, flowerpot,
// ...), one of its pairs (metu_sunny_scene_7, ...), or the whole path of a folder like those.
// --colmap poses with COLMAP's mapper on all pairs at full settings instead, --global by the global
// mapper on the orbit's pairs alone.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string_view>
#include <vector>

#include "core/system/clock.hpp"
#include "core/system/cpu.hpp"
#include "core/system/parallel.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "recon/poses/global_sfm/global_mapper.hpp"
#include "recon/poses/sfm/colmap.hpp"
#include "recon/poses/sfm/sfm_ladder.hpp"
#include "tests/support/orbit_scenes.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace orbitfuse;
namespace fs = std::filesystem;

struct Request {
  std::vector<std::string> scenes;
  double focal_error = 0.03;
  bool stations = true, focal = true, colmap = false, global = false, views = false;
  std::size_t first = 0;  ///< photos; 0: all
};

/// Visible images of a folder, or of its folder visible/, in the order of their names.
scenes::Scene photos(const fs::path& folder) {
  scenes::Scene scene;
  scene.session.folder = folder;
  DeviceInfo device;
  device.id = "visible0";
  scene.session.devices.push_back(device);
  std::vector<fs::path> files;
  const fs::path inside = fs::exists(folder / "visible") ? folder / "visible" : folder;
  for (const auto& entry : fs::directory_iterator(inside))
    if (entry.path().extension() == ".jpg" || entry.path().extension() == ".png")
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    const cv::Mat image = cv::imread(file.string());
    FrameRecord frame;
    frame.device = device.id;
    frame.file = fs::relative(file, folder).string();
    frame.width = image.cols, frame.height = image.rows;
    frame.sequence = scene.session.frames.size();
    scene.session.frames.push_back(frame);
  }
  return scene;
}

scenes::Scene load(const fs::path& data, const std::string& which, const Request& request) {
  const fs::path folder = data / "orbits" / which;
  scenes::Scene scene;
  if (which == "fox") {
    scene = scenes::fox_scene(data);
  } else if (fs::exists(folder / "ground_truth.json") && which != "lego") {
    scenes::ContainerOptions options;
    options.scene = which;
    options.visible_focal_error = request.focal_error;
    scene = scenes::container_scene(data, options);
  } else {
    scene = photos(fs::exists(folder) ? folder : data / "pairs" / which);
  }
  std::erase_if(scene.session.frames,
                [](const FrameRecord& frame) { return frame.modality != Modality::visible; });
  if (request.first > 0 && request.first < scene.session.frames.size())
    scene.session.frames.resize(request.first);
  if (!request.stations)
    for (FrameRecord& frame : scene.session.frames) frame.station.reset();
  if (!request.focal)
    for (DeviceInfo& device : scene.session.devices) device.lens.focal_px.reset();
  return scene;
}

struct Matched {
  std::vector<ProxyImage> images;
  ColmapProject project;
};

Result<Matched> matched(const Session& session, const std::vector<ViewPair>& pairs,
                        const PoseOptions& options, const fs::path& workdir) {
  ProxyOptions proxies;
  proxies.max_side_px = options.max_image_side_px;
  ColmapOptions engine;
  engine.max_features = options.max_features;
  Matched result;
  ORBITFUSE_ASSIGN(result.images, write_proxies(session, session.frames_of(Modality::visible),
                                                proxies, workdir / "images", {}));
  ORBITFUSE_ASSIGN(result.project,
                   ColmapProject::create(workdir / "colmap", workdir / "images", engine));
  ORBITFUSE_TRY(result.project.extract(session, result.images, {}));
  ORBITFUSE_TRY(result.project.match(result.images, pairs, {}));
  return result;
}

/// A model and the gates' word on it, as the ladder's one step.
Result<ModalityPoses> only_step(const std::string& attempt, const std::string& found,
                                Reconstruction model, const Session& session,
                                const PoseOptions& options) {
  if (model.views.size() < 2) return fail(ErrorKind::quality, attempt, "no model", "see its log");
  const auto frames = session.frames_of(Modality::visible);
  ORBITFUSE_ASSIGN(JudgedModel judged, judge_model(std::move(model), session, frames, options));
  judged.poses.ladder.push_back({attempt, judged.believed, found + judged.why,
                                 static_cast<int>(judged.poses.reconstruction.views.size()),
                                 static_cast<int>(frames.size()), 0});
  return std::move(judged.poses);
}

/// What the ladder must not fall behind.
Result<ModalityPoses> colmap_poses(const Session& session, const fs::path& workdir) {
  PoseOptions options;
  options.max_image_side_px = 3200;
  options.max_features = 8192;
  options.min_posed_ratio = 0;
  const auto count = static_cast<int>(session.frames_of(Modality::visible).size());
  ORBITFUSE_ASSIGN(Matched all, matched(session, exhaustive_pairs(count), options, workdir));
  ORBITFUSE_ASSIGN(Reconstruction model, all.project.map(session, all.images, {}, {}));
  return only_step("COLMAP, all pairs, full settings", "", std::move(model), session, options);
}

/// What stands in where COLMAP finds nothing.
Result<ModalityPoses> global_poses(const Session& session, const fs::path& workdir) {
  const auto frames = session.frames_of(Modality::visible);
  const PoseOptions options;
  ORBITFUSE_ASSIGN(const Matched orbit, matched(session, orbit_pairs(frames), options, workdir));
  ORBITFUSE_ASSIGN(FeatureGraph graph,
                   read_feature_graph(orbit.project.database(), session, orbit.images));
  const Adjuster adjust = [&](Reconstruction model) -> Result<Reconstruction> {
    ORBITFUSE_ASSIGN(ModalityPoses poses, adjust_model(std::move(model), session, frames, options));
    return std::move(poses.reconstruction);
  };
  ORBITFUSE_ASSIGN(GlobalModel global, map_globally(graph, adjust, {}, {}));
  return only_step("global mapper", global.found + "; ", std::move(global.model), session, options);
}

/// What each view is off by, and how many points hold it.
void print_views(const ModalityPoses& poses, const PoseError& error) {
  for (const ViewError& view : error.each) {
    std::size_t points = 0;
    for (const SparsePoint& point : poses.reconstruction.points)
      for (const Observation& seen : point.track)
        points += poses.reconstruction.views[static_cast<std::size_t>(seen.view)].name == view.name;
    fmt::print("    {}: centre {:.3f} % (outward {:.3f}), rotation {:.3f} deg, {} points\n",
               view.name, view.center_percent, view.outward_percent, view.rotation_deg, points);
  }
  const Camera& camera = poses.reconstruction.views.front().camera;
  fmt::print("    {}x{}, focal length {:.1f} px, {} points\n", camera.width, camera.height,
             camera.fx, poses.reconstruction.points.size());
}

/// Whether the word on each view is right: off means by more than 2 % of the extent or 2 degrees.
void print_verdicts(const ModalityPoses& poses, const PoseError& error) {
  int sure_but_off = 0, right_yet_doubted = 0;
  for (const ViewError& view : error.each) {
    const bool off = view.center_percent > 2 || view.rotation_deg > 2;
    const bool doubted = std::any_of(poses.doubtful.begin(), poses.doubtful.end(),
                                     [&](const DoubtfulView& d) { return d.name == view.name; });
    sure_but_off += off && !doubted;
    right_yet_doubted += !off && doubted;
  }
  for (const DoubtfulView& view : poses.doubtful)
    fmt::print("  in doubt {}: {}\n", view.name, view.why);
  fmt::print("  sure but off: {}; right, yet doubted: {}\n", sure_but_off, right_yet_doubted);
}

void print(const scenes::Scene& scene, const Result<ModalityPoses>& poses, double cpu_s,
           bool views) {
  if (!poses) {
    fmt::print("  {}; {:.1f} CPU s\n", poses.error().message(), cpu_s);
    return;
  }
  for (const LadderStep& step : poses->ladder)
    fmt::print("  {} {}: {}/{} in {:.1f} s: {}\n", step.held ? "held" : "fell", step.attempt,
               step.posed, step.total, step.seconds, step.why);
  for (const DroppedView& view : poses->dropped)
    fmt::print("  dropped {}: {}\n", view.name, view.why);
  fmt::print("  posed {}/{}, {:.1f} CPU s", poses->reconstruction.views.size(), poses->frame_count,
             cpu_s);
  const PoseError error =
      scenes::pose_error(poses->reconstruction, poses->reconstruction, scene.truth);
  if (error.views > 0)
    fmt::print(
        "; centres RMS {:.3f} %, worst {:.3f} % of the extent; rotation mean {:.3f}, worst "
        "{:.3f} deg",
        error.ate_percent, error.ate_max_percent, error.rotation_mean_deg, error.rotation_max_deg);
  fmt::print("\n");
  if (error.views > 0) print_verdicts(*poses, error);
  if (views) print_views(*poses, error);
}

Request parsed(int argc, char** argv) {
  Request request;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--focal-error" && i + 1 < argc)
      request.focal_error = std::strtod(argv[++i], nullptr);
    else if (word == "--no-stations")
      request.stations = false;
    else if (word == "--no-focal")
      request.focal = false;
    else if (word == "--colmap")
      request.colmap = true;
    else if (word == "--global")
      request.global = true;
    else if (word == "--first" && i + 1 < argc)
      request.first = std::strtoul(argv[++i], nullptr, 10);
    else if (word == "--views")
      request.views = true;
    else
      request.scenes.emplace_back(word);
  }
  return request;
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const fs::path data = testing::shared_data();
  const Request request = parsed(argc, argv);
  if (request.scenes.empty() || !fs::exists(data)) {
    std::fputs(
        "bench_visible SCENE... [--focal-error R] [--no-stations] [--no-focal] [--colmap | "
        "--global] [--first N] [--views]; needs the shared data (ORBITFUSE_SHARED)\n",
        stderr);
    return 2;
  }
  fmt::print("{}; {} threads\n", cpu_description(), thread_count());
  for (const std::string& which : request.scenes) {
    fmt::print("{}\n", which);
    const scenes::Scene scene = load(data, which, request);
    const test::TempFolder work;
    const double before = cpu_seconds();
    const auto poses = request.colmap ? colmap_poses(scene.session, work.path())
                       : request.global
                           ? global_poses(scene.session, work.path())
                           : estimate_visible_poses(scene.session, PoseOptions{}, work.path(), {});
    print(scene, poses, cpu_seconds() - before, request.views);
  }
  return 0;
}
