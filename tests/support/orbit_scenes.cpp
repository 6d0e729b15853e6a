// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/orbit_scenes.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "core/formats/ground_truth.hpp"
#include "core/formats/transforms_json.hpp"

namespace orbitfuse::scenes {
namespace {

namespace fs = std::filesystem;

DeviceInfo device(Modality modality, std::optional<double> focal_px) {
  DeviceInfo info;
  info.id = fmt::format("{}0", name(modality));
  info.modality = modality;
  info.lens.focal_px = focal_px;
  return info;
}

FrameRecord frame(Modality modality, const std::string& file, int width, int height,
                  std::uint64_t sequence) {
  FrameRecord record;
  record.modality = modality;
  record.device = fmt::format("{}0", name(modality));
  record.file = file;
  record.width = width, record.height = height;
  record.sequence = sequence;
  return record;
}

/// Data that tests and benchmarks come with: a fault in it is theirs.
GroundTruth truth_of(const fs::path& file) { return read_ground_truth(file).value(); }

}  // namespace

Scene container_scene(const fs::path& data, const ContainerOptions& options) {
  Scene scene;
  scene.session.folder = data / "orbits" / options.scene;
  const GroundTruth truth = truth_of(scene.session.folder / "ground_truth.json");
  for (const auto& [modality, views] : truth.views) {
    const double error =
        modality == Modality::visible ? options.visible_focal_error : options.thermal_focal_error;
    scene.session.devices.push_back(device(modality, views.at(0).camera.fx * (1.0 + error)));
    int index = 0;
    for (const TrueView& view : views) {
      FrameRecord record = frame(modality, view.name, view.camera.width, view.camera.height,
                                 static_cast<std::uint64_t>(index));
      Station station;
      station.loop = index / 12, station.index = index % 12;
      station.azimuth_deg = (options.mirrored_stations ? -30.0 : 30.0) * (index % 12) +
                            (index % 2 == 0 ? 1 : -1) * options.station_error_deg;
      station.azimuth_sigma_deg = 8;
      station.elevation_sigma_deg.reset();
      record.station = station;
      scene.session.frames.push_back(record);
      scene.truth.views[record.file] = view;
      ++index;
    }
  }
  if (!options.tracking) return scene;
  const auto tracking = read_true_views(scene.session.folder / "tracking.json").value();
  std::uint64_t index = 24;
  for (const TrueView& view : tracking) {
    FrameRecord record =
        frame(Modality::thermal, view.name, view.camera.width, view.camera.height, index++);
    record.tracking = true;
    scene.session.frames.push_back(record);
    scene.truth.views[record.file] = view;
  }
  return scene;
}

Scene fox_scene(const fs::path& data) {
  Scene scene;
  scene.session.folder = data / "orbits" / "fox";
  auto transforms = read_transforms_json(scene.session.folder / "transforms.json");
  if (!transforms) return scene;
  scene.session.devices.push_back(device(Modality::visible, std::nullopt));
  std::sort(transforms->frames.begin(), transforms->frames.end(),
            [](const auto& a, const auto& b) { return a.file_path < b.file_path; });
  std::uint64_t index = 0;
  for (const TransformsFrame& f : transforms->frames) {
    scene.session.frames.push_back(
        frame(Modality::visible, f.file_path, f.camera.width, f.camera.height, index++));
    scene.truth.views[f.file_path] = {f.file_path, f.camera, f.cam_from_world};
  }
  return scene;
}

Scene session_scene(const fs::path& folder) {
  Scene scene;
  auto session = open_session(folder);
  if (!session) return scene;
  scene.session = *std::move(session);
  const GroundTruth truth = truth_of(folder / "ground_truth.json");
  for (const auto& [modality, views] : truth.views)
    for (const TrueView& view : views) scene.truth.views[view.name] = view;
  return scene;
}

Result<Scene> run_scene(const fs::path& session, const fs::path& truth_file) {
  Scene scene;
  ORBITFUSE_ASSIGN(scene.session, open_session(session));
  ORBITFUSE_ASSIGN(const GroundTruth truth, read_ground_truth(truth_file));
  for (const auto& [modality, views] : truth.views) {
    std::map<std::string, PosedView> by_name;
    for (const TrueView& view : views) by_name[view.name] = view;
    for (const FrameRecord* frame : scene.session.frames_of(modality)) {
      const auto found = by_name.find(frame->source.empty() ? frame->file : frame->source);
      if (found != by_name.end()) scene.truth.views[frame->file] = found->second;
    }
  }
  for (const TrueTestView& view : truth.test)
    scene.test.push_back({"", view.camera, view.cam_from_world});
  return scene;
}

void add_tracking(Scene& scene, const fs::path& tracking_json) {
  const auto tracking = read_true_views(tracking_json).value();
  const FrameRecord like = *scene.session.frames_of(Modality::thermal).back();
  std::uint64_t sequence = like.sequence + 1;
  for (const TrueView& view : tracking) {
    FrameRecord record = like;
    record.file = (tracking_json.parent_path() / view.name).string();
    record.station.reset();
    record.sequence = sequence++;
    record.tracking = true;
    scene.truth.views[record.file] = view;
    scene.session.frames.push_back(std::move(record));
  }
}

Scene folder_scene(const fs::path& folder) {
  Scene scene;
  scene.session.folder = folder;
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    scene.session.devices.push_back(device(modality, std::nullopt));
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder / name(modality)))
      if (entry.is_regular_file()) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::uint64_t index = 0;
    for (const fs::path& file : files) {
      const cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
      if (image.empty()) continue;
      FrameRecord record =
          frame(modality, fs::relative(file, folder).string(), image.cols, image.rows, index++);
      record.thermal_is_gray = modality == Modality::thermal;
      scene.session.frames.push_back(record);
    }
  }
  return scene;
}

namespace {
std::vector<PosePair> pairs_of(const Reconstruction& model, const Truth& truth) {
  std::vector<PosePair> pairs;
  for (const PosedView& view : model.views) {
    const auto found = truth.views.find(view.name);
    if (found != truth.views.end())
      pairs.push_back({view.cam_from_world, found->second.cam_from_world, view.name});
  }
  return pairs;
}
}  // namespace

Result<Similarity3d> truth_from_model(const Reconstruction& model, const Truth& truth) {
  return truth_from_estimate(pairs_of(model, truth));
}

PoseError pose_error(const Reconstruction& model, const Reconstruction& anchor,
                     const Truth& truth) {
  const auto fit = truth_from_model(anchor, truth);
  return fit ? pose_error(pairs_of(model, truth), *fit) : PoseError{};
}

}  // namespace orbitfuse::scenes
