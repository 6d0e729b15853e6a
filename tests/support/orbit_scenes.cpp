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

std::optional<Similarity3d> model_from_truth(const Reconstruction& model, const Truth& truth) {
  std::vector<const PosedView*> pairs;
  for (const PosedView& view : model.views)
    if (truth.views.contains(view.name)) pairs.push_back(&view);
  if (pairs.size() < 3) return std::nullopt;
  Eigen::Matrix3Xd ours(3, static_cast<Eigen::Index>(pairs.size())), theirs = ours;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    ours.col(static_cast<Eigen::Index>(i)) = camera_center(pairs[i]->cam_from_world);
    theirs.col(static_cast<Eigen::Index>(i)) =
        camera_center(truth.views.at(pairs[i]->name).cam_from_world);
  }
  const Eigen::Matrix4d m = Eigen::umeyama(theirs, ours, true);
  Similarity3d fit;
  fit.scale = std::cbrt(m.topLeftCorner<3, 3>().determinant());
  fit.rotation = Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>() / fit.scale));
  fit.translation = m.topRightCorner<3, 1>();
  return fit;
}

PoseError pose_error(const Reconstruction& model, const Reconstruction& anchor,
                     const Truth& truth) {
  PoseError error;
  const std::optional<Similarity3d> fit = model_from_truth(anchor, truth);
  if (!fit) return error;
  const Similarity3d truth_from_model = fit->inverse();

  // Extent: the greatest distance between two true camera centres of the judged modality.
  std::vector<Eigen::Vector3d> centers;
  std::vector<double> offsets, angles;
  for (const PosedView& view : model.views) {
    const auto found = truth.views.find(view.name);
    if (found == truth.views.end()) continue;
    centers.push_back(camera_center(found->second.cam_from_world));
    const Rigid3d moved = rebase(view.cam_from_world, truth_from_model);
    offsets.push_back((camera_center(moved) - centers.back()).norm());
    angles.push_back(rotation_angle_deg(moved.rotation, found->second.cam_from_world.rotation));
    const Eigen::Vector3d off = camera_center(moved) - centers.back();
    const Eigen::Vector3d back =
        -(found->second.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ());
    error.each.push_back({view.name, off.norm(), off.dot(back), angles.back()});
    error.mean_rotation_deg += angles.back();
  }
  if (offsets.empty()) return error;
  double extent = 0, sum = 0;
  for (const auto& a : centers)
    for (const auto& b : centers) extent = std::max(extent, (a - b).norm());
  for (const double d : offsets) sum += d * d;
  for (ViewError& view : error.each)
    view.center_percent *= 100 / extent, view.outward_percent *= 100 / extent;
  error.mean_rotation_deg /= static_cast<double>(angles.size());
  std::sort(offsets.begin(), offsets.end());
  std::sort(angles.begin(), angles.end());
  error.views = static_cast<int>(offsets.size());
  error.ate_percent = 100 * std::sqrt(sum / static_cast<double>(offsets.size())) / extent;
  error.median_percent = 100 * offsets[offsets.size() / 2] / extent;
  error.worst_percent = 100 * offsets.back() / extent;
  error.rotation_deg = angles[angles.size() / 2];
  error.worst_rotation_deg = angles.back();
  return error;
}

}  // namespace orbitfuse::scenes
