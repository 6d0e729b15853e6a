// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/artifacts.hpp"

#include <fmt/format.h>

#include <array>

#include "app/pipeline/stage_record.hpp"
#include "core/formats/colmap_model.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/image/image_io.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"
#include "core/temperature.hpp"

namespace orbitfuse::stages {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

json camera_json(const Camera& c) {
  return {{"width", c.width}, {"height", c.height}, {"fx", c.fx},
          {"fy", c.fy},       {"cx", c.cx},         {"cy", c.cy}};
}

Camera camera_of_json(const json& j) {
  Camera c;
  j.at("width").get_to(c.width);
  j.at("height").get_to(c.height);
  j.at("fx").get_to(c.fx);
  j.at("fy").get_to(c.fy);
  j.at("cx").get_to(c.cx);
  j.at("cy").get_to(c.cy);
  return c;
}

fs::path depth_file(const fs::path& folder, const DepthMap& map, const char* kind) {
  return folder / fmt::format("{:03}_{}.tiff", map.view, kind);
}

constexpr const char* normal_kinds[] = {"normal_x", "normal_y", "normal_z"};

}  // namespace

Status write_json(const fs::path& file, const json& j) {
  return write_file_atomic(file, j.dump(2) + "\n");
}

Result<json> read_json(const fs::path& file) {
  ORBITFUSE_ASSIGN(const std::string text, read_file(file));
  json j = parse_json(text);
  if (j.is_discarded())
    return fail(ErrorKind::input, file.string(), "not JSON", "run the stage that writes it again");
  return j;
}

pipeline::StageContext context_of_run(const fs::path& out) {
  pipeline::StageContext context;
  context.out = out;
  context.finished = pipeline::finished_stages(out);
  return context;
}

Status save_poses(const fs::path& folder, const Reconstruction& model) {
  ORBITFUSE_TRY(write_colmap_model(folder / "model", model, ColmapFormat::binary));
  Transforms transforms;
  for (const PosedView& view : model.views) {
    TransformsFrame frame{view.name, {}, view.camera, view.cam_from_world};
    if (model.modality == Modality::thermal) frame.thermal_file_path = view.name;
    transforms.frames.push_back(std::move(frame));
  }
  return write_transforms_json(folder / "transforms.json", transforms);
}

Result<Reconstruction> load_poses(const fs::path& folder, Modality modality) {
  return read_colmap_model(folder / "model", modality);
}

Result<Reconstruction> load_trained_poses(const pipeline::StageContext& context,
                                          Modality modality) {
  const std::string of(name(modality));
  if (context.has("train_" + of) && fs::exists(context.of("train_" + of) / "model"))
    return load_poses(context.of("train_" + of), modality);
  return load_poses(context.of("poses_" + of), modality);
}

Result<std::map<std::string, std::string>> load_doubts(const fs::path& folder) {
  ORBITFUSE_ASSIGN(const pipeline::StageRecord record, pipeline::read_stage_record(folder));
  std::map<std::string, std::string> doubts;
  const json& metrics = record.output.metrics;
  if (!metrics.contains("doubtful")) return doubts;
  const auto is_text = [](const json& entry, const char* key) {
    return entry.is_object() && entry.contains(key) && entry[key].is_string();
  };
  for (const json& entry : metrics["doubtful"])
    if (is_text(entry, "view"))
      doubts[entry["view"]] = is_text(entry, "why") ? entry["why"] : json("doubtful");
  return doubts;
}

Status save_depth_maps(const fs::path& folder, const std::vector<DepthMap>& maps) {
  json list = json::array();
  for (const DepthMap& map : maps) {
    ORBITFUSE_TRY(write_float_tiff(depth_file(folder, map, "depth"), map.depth));
    ORBITFUSE_TRY(write_float_tiff(depth_file(folder, map, "confidence"), map.confidence));
    std::vector<cv::Mat> axes;
    if (!map.normal.empty()) cv::split(map.normal, axes);
    for (std::size_t i = 0; i < axes.size(); ++i)
      ORBITFUSE_TRY(write_float_tiff(depth_file(folder, map, normal_kinds[i]), axes[i]));
    list.push_back(
        {{"view", map.view}, {"camera", camera_json(map.camera)}, {"normal", !map.normal.empty()}});
  }
  return write_json(folder / "depth.json", list);
}

Result<std::vector<DepthMap>> load_depth_maps(const fs::path& folder) {
  ORBITFUSE_ASSIGN(const json list, read_json(folder / "depth.json"));
  std::vector<DepthMap> maps;
  try {
    for (const json& j : list) {
      DepthMap map;
      j.at("view").get_to(map.view);
      map.camera = camera_of_json(j.at("camera"));
      ORBITFUSE_ASSIGN(map.depth, read_float_tiff(depth_file(folder, map, "depth")));
      ORBITFUSE_ASSIGN(map.confidence, read_float_tiff(depth_file(folder, map, "confidence")));
      if (j.at("normal").get<bool>()) {
        cv::Mat axes[3];
        for (int i = 0; i < 3; ++i) {
          ORBITFUSE_ASSIGN(axes[i], read_float_tiff(depth_file(folder, map, normal_kinds[i])));
        }
        cv::merge(axes, 3, map.normal);
      }
      maps.push_back(std::move(map));
    }
  } catch (const json::exception& e) {
    return fail(ErrorKind::input, (folder / "depth.json").string(), e.what(),
                "run with --force to make it again");
  }
  return maps;
}

Status save_temperature_bounds(const fs::path& folder, double low_k, double high_k) {
  return write_json(folder / "temperature_bounds.json",
                    {{"absolute_min_temperature", celsius_from_kelvin(low_k)},
                     {"absolute_max_temperature", celsius_from_kelvin(high_k)},
                     {"unit", "degrees Celsius"}});
}

json to_json(const Similarity3d& s) {
  return {{"scale", s.scale},
          {"rotation_wxyz", {s.rotation.w(), s.rotation.x(), s.rotation.y(), s.rotation.z()}},
          {"translation", {s.translation.x(), s.translation.y(), s.translation.z()}}};
}

namespace {

constexpr const char* pose_frame_file = "poses.json";
constexpr const char* registration_file = "registration.json";
constexpr const char* run_again = "run the stage that writes it again (--force)";

}  // namespace

Status save_pose_frame(const fs::path& folder, PoseFrame frame) {
  return write_json(folder / pose_frame_file, {{"shared_frame", frame == PoseFrame::visible}});
}

Result<PoseFrame> load_pose_frame(const fs::path& folder) {
  ORBITFUSE_ASSIGN(const json j, read_json(folder / pose_frame_file));
  const auto shared = j.find("shared_frame");
  if (shared == j.end() || !shared->is_boolean())
    return fail(ErrorKind::input, (folder / pose_frame_file).string(),
                "no shared_frame (true or false) in it", run_again);
  return shared->get<bool>() ? PoseFrame::visible : PoseFrame::own;
}

Status save_registration(const fs::path& folder, const RegistrationRecord& record) {
  return write_json(folder / registration_file,
                    {{"schema", 1},
                     {"conventions", "x_visible = scale * R * x_thermal + t"},
                     {"how", record.how},
                     {"visible_from_thermal", to_json(record.visible_from_thermal)}});
}

Result<RegistrationRecord> load_registration(const fs::path& folder) {
  ORBITFUSE_ASSIGN(const json j, read_json(folder / registration_file));
  try {
    RegistrationRecord record;
    j.at("how").get_to(record.how);
    const json& s = j.at("visible_from_thermal");
    const auto q = s.at("rotation_wxyz").get<std::array<double, 4>>();
    const auto t = s.at("translation").get<std::array<double, 3>>();
    Similarity3d& similarity = record.visible_from_thermal;
    s.at("scale").get_to(similarity.scale);
    similarity.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
    similarity.translation = {t[0], t[1], t[2]};
    if (similarity.is_finite() && similarity.scale > 0) return record;
  } catch (const json::exception&) {  // reported below
  }
  return fail(ErrorKind::input, (folder / registration_file).string(), "no similarity in it",
              run_again);
}

}  // namespace orbitfuse::stages
