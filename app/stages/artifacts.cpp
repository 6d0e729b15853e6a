// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/artifacts.hpp"

#include <fmt/format.h>

#include <array>
#include <functional>

#include "app/stages/build_stages.hpp"
#include "core/formats/colmap_model.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/geometry/geometry_json.hpp"
#include "core/image/image_io.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"
#include "core/system/side_by_side.hpp"
#include "core/temperature.hpp"

namespace orbitfuse::stages {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

fs::path depth_file(const fs::path& folder, const DepthMap& map, const char* kind) {
  return folder / fmt::format("{:03}_{}.tiff", map.view, kind);
}

constexpr std::array normal_kinds = {"normal_x", "normal_y", "normal_z"};
constexpr const char* run_again = "run the stage that writes it again (--force)";

Status save_depth_map(const fs::path& folder, const DepthMap& map) {
  ORBITFUSE_TRY(write_float_tiff(depth_file(folder, map, "depth"), map.depth));
  ORBITFUSE_TRY(write_float_tiff(depth_file(folder, map, "confidence"), map.confidence));
  std::vector<cv::Mat> axes;
  if (!map.normal.empty()) cv::split(map.normal, axes);
  for (std::size_t i = 0; i < axes.size(); ++i)
    ORBITFUSE_TRY(write_float_tiff(depth_file(folder, map, normal_kinds[i]), axes[i]));
  return {};
}

void remove_depth_map(const fs::path& folder, const DepthMap& map) {
  std::error_code ignored;
  for (const char* kind :
       {"depth", "confidence", normal_kinds[0], normal_kinds[1], normal_kinds[2]})
    fs::remove(depth_file(folder, map, kind), ignored);
}

Result<DepthMap> load_depth_map(const fs::path& folder, const JsonFields& entry) {
  DepthMap map;
  bool has_normal = false;
  ORBITFUSE_TRY(entry.get_all("view", map.view, "normal", has_normal));
  ORBITFUSE_ASSIGN(const JsonFields camera, entry.child("camera"));
  ORBITFUSE_ASSIGN(map.camera, camera_of_json(camera));
  ORBITFUSE_ASSIGN(map.depth, read_float_tiff(depth_file(folder, map, "depth")));
  ORBITFUSE_ASSIGN(map.confidence, read_float_tiff(depth_file(folder, map, "confidence")));
  if (!has_normal) return map;
  cv::Mat axes[3];
  for (int i = 0; i < 3; ++i) {
    ORBITFUSE_ASSIGN(axes[i], read_float_tiff(depth_file(folder, map, normal_kinds[i])));
  }
  cv::merge(axes, 3, map.normal);
  return map;
}

}  // namespace

Status write_json(const fs::path& file, const json& j) {
  return write_file_atomic(file, j.dump(2) + "\n");
}

Result<json> read_json(const fs::path& file) {
  ORBITFUSE_ASSIGN(const std::string text, read_file(file));
  json j = parse_json(text);
  if (j.is_discarded()) return fail(ErrorKind::input, file.string(), json_fault(text), run_again);
  return j;
}

JsonFields stage_fields(const json& j, const fs::path& file) {
  return {j, file.string() + ": ", {ErrorKind::input, run_again}};
}

JsonFields metric_fields(const pipeline::StageRecord& record, const fs::path& folder) {
  return {record.output.metrics,
          (folder / pipeline::stage_record_file).string() + ": metrics.",
          {ErrorKind::input, run_again}};
}

pipeline::StageContext context_of_run(const fs::path& out) {
  pipeline::StageContext context;
  context.out = out;
  context.finished = pipeline::finished_stages(out, stage_names());
  return context;
}

Status check_up_to_date(const fs::path& out) {
  const std::vector<std::string> late = pipeline::out_of_date(
      out, {"depth", "train_visible", "poses_thermal", "train_thermal", "register"});
  if (late.empty()) return {};
  return fail(ErrorKind::input, out.string(), late.front(),
              "bring the run up to date: orbitfuse run SESSION --out " + out.string());
}

Status check_as_written(const pipeline::StageContext& context) {
  for (const char* stage :
       {"poses_visible", "train_visible", "poses_thermal", "train_thermal", "register"}) {
    if (!context.has(stage)) continue;
    ORBITFUSE_ASSIGN(const pipeline::StageRecord record,
                     pipeline::read_stage_record(context.of(stage)));
    if (const auto wrong = pipeline::damage(context.of(stage), record))
      return fail(
          ErrorKind::input, context.of(stage).string(), *wrong,
          "restore it, or make it again: orbitfuse run SESSION --out " + context.out.string());
  }
  return {};
}

Status save_poses(const pipeline::StageContext& context, const Session& session,
                  const Reconstruction& model) {
  ORBITFUSE_TRY(write_colmap_model(context.folder / "model", model, ColmapFormat::binary));
  // Where the stage's folder will be, not where it is being made; without links, which ".." of a
  // relative path would not come back from.
  std::error_code unreadable;
  const fs::path there = fs::weakly_canonical(context.out, unreadable) / context.folder.filename();
  const fs::path images = fs::weakly_canonical(session.folder, unreadable);
  std::map<std::string, std::string> sources;
  for (const FrameRecord* frame : session.frames_of(model.modality))
    sources[frame->file] = frame->source;
  Transforms transforms;
  for (const PosedView& view : model.views) {
    const std::string file = (images / view.name).lexically_proximate(there).string();
    TransformsFrame frame{file, {}, view.camera, view.cam_from_world, sources[view.name]};
    if (model.modality == Modality::thermal) frame.thermal_file_path = file;
    transforms.frames.push_back(std::move(frame));
  }
  return write_transforms_json(context.folder / "transforms.json", transforms);
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
  ORBITFUSE_ASSIGN(const std::vector<JsonFields> doubtful,
                   metric_fields(record, folder).children("doubtful"));
  std::map<std::string, std::string> doubts;
  for (const JsonFields& entry : doubtful) {
    std::string view;
    ORBITFUSE_TRY(entry.get("view", view));
    ORBITFUSE_TRY(entry.get("why", doubts[view]));
  }
  return doubts;
}

Result<TrainedFrames> load_trained_frames(const fs::path& folder) {
  ORBITFUSE_ASSIGN(const pipeline::StageRecord record, pipeline::read_stage_record(folder));
  const JsonFields metrics = metric_fields(record, folder);
  TrainedFrames frames;
  ORBITFUSE_TRY(metrics.get_all("heldout", frames.heldout, "width_px", frames.width_px));
  ORBITFUSE_TRY(metrics.get_present("heldout_psnr_db", frames.heldout_psnr_db));
  if (metrics.has("shading_k"))
    ORBITFUSE_TRY(metrics.get("shading_k", frames.shading_k));  // 2026-11
  if (metrics.has("gray_curves")) {                             // 2026-11-28
    ORBITFUSE_ASSIGN(const JsonFields curves, metrics.child("gray_curves"));
    for (const std::string& view : curves.keys())
      ORBITFUSE_TRY(curves.get(view.c_str(), frames.gray_curves[view]));
  }
  ORBITFUSE_ASSIGN(const JsonFields gains, metrics.child("image_gains"));
  for (const std::string& view : gains.keys())
    ORBITFUSE_TRY(gains.get(view.c_str(), frames.gains[view]));
  // Older runs have an array that names no frames.
  if (const json* drift = metrics.find("image_offsets_k"); drift != nullptr && drift->is_array())
    return frames;
  ORBITFUSE_ASSIGN(const JsonFields offsets, metrics.child("image_offsets_k"));
  for (const std::string& view : offsets.keys())
    ORBITFUSE_TRY(offsets.get(view.c_str(), frames.offsets_k[view]));
  return frames;
}

Result<FusedImages> load_fused_images(const fs::path& folder) {
  ORBITFUSE_ASSIGN(const pipeline::StageRecord record, pipeline::read_stage_record(folder));
  FusedImages fused;
  ORBITFUSE_TRY(metric_fields(record, folder)
                    .get_all("methods", fused.methods, "measured_share", fused.measured_share));
  return fused;
}

Status save_depth_maps(const fs::path& folder, const std::vector<DepthMap>& maps) {
  json list = json::array();
  std::vector<std::function<Status()>> writes;
  for (const DepthMap& map : maps) {
    writes.emplace_back([&] { return save_depth_map(folder, map); });
    list.push_back({{"view", map.view},
                    {"camera", pinhole_json(map.camera)},
                    {"normal", !map.normal.empty()}});
  }
  Status written = side_by_side(writes);
  if (written) written = write_json(folder / "depth.json", list);
  // Useless without the others, and a full disk needs room for what says so.
  if (!written)
    for (const DepthMap& map : maps) remove_depth_map(folder, map);
  return written;
}

Result<std::vector<DepthMap>> load_depth_maps(const fs::path& folder) {
  const fs::path file = folder / "depth.json";
  ORBITFUSE_ASSIGN(const json list, read_json(file));
  const json named = {{"maps", list}};
  ORBITFUSE_ASSIGN(const std::vector<JsonFields> entries,
                   stage_fields(named, file).children("maps"));
  std::vector<DepthMap> maps(entries.size());
  std::vector<std::function<Status()>> reads;
  for (std::size_t i = 0; i < entries.size(); ++i)
    reads.emplace_back([&, i]() -> Status {
      ORBITFUSE_ASSIGN(maps[i], load_depth_map(folder, entries[i]));
      return {};
    });
  ORBITFUSE_TRY(side_by_side(reads));
  return maps;
}

Status save_temperature_bounds(const fs::path& folder, double low_k, double high_k) {
  return write_json(folder / "temperature_bounds.json",
                    {{"absolute_min_temperature", celsius_from_kelvin(low_k)},
                     {"absolute_max_temperature", celsius_from_kelvin(high_k)},
                     {"unit", "degrees Celsius"}});
}

namespace {

constexpr const char* pose_frame_file = "poses.json";
constexpr const char* registration_file = "registration.json";

}  // namespace

Status save_pose_frame(const fs::path& folder, PoseFrame frame,
                       const std::vector<std::string>& doubtful) {
  return write_json(folder / pose_frame_file,
                    {{"shared_frame", frame == PoseFrame::visible}, {"doubtful", doubtful}});
}

Result<PoseFrame> load_pose_frame(const fs::path& folder) {
  ORBITFUSE_ASSIGN(const json j, read_json(folder / pose_frame_file));
  bool shared = false;
  ORBITFUSE_TRY(stage_fields(j, folder / pose_frame_file).get("shared_frame", shared));
  return shared ? PoseFrame::visible : PoseFrame::own;
}

Status save_registration(const fs::path& folder, const RegistrationRecord& record) {
  return write_json(folder / registration_file,
                    {{"schema", 1},
                     {"conventions", "x_visible = scale * R * x_thermal + t"},
                     {"how", record.how},
                     {"visible_from_thermal", similarity_json(record.visible_from_thermal)}});
}

Result<RegistrationRecord> load_registration(const fs::path& folder) {
  ORBITFUSE_ASSIGN(const json j, read_json(folder / registration_file));
  const JsonFields fields = stage_fields(j, folder / registration_file);
  RegistrationRecord record;
  ORBITFUSE_TRY(fields.get("how", record.how));
  ORBITFUSE_ASSIGN(const JsonFields similarity, fields.child("visible_from_thermal"));
  ORBITFUSE_ASSIGN(record.visible_from_thermal, similarity_of_json(similarity));
  return record;
}

}  // namespace orbitfuse::stages
