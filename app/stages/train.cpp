// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "app/stages/artifacts.hpp"
#include "app/stages/learned_views.hpp"
#include "app/stages/stage_list.hpp"
#include "app/stages/train_extension.hpp"
#include "core/first_names.hpp"
#include "core/formats/ply.hpp"
#include "core/system/side_by_side.hpp"
#include "recon/assembly/thermal_depth.hpp"
#include "recon/assembly/training_data.hpp"
#include "recon/nerf/nerf.hpp"

namespace orbitfuse::stages {
namespace {
using nlohmann::json;
using pipeline::StageContext;
using pipeline::StageOutput;

/// The field that lends its geometry: the visible one, when thermal poses live in its frame.
Result<nerf::Field> guide_field(const StageContext& context) {
  if (!context.has("train_visible")) return nerf::Field();
  ORBITFUSE_ASSIGN(const PoseFrame frame, load_pose_frame(context.of("poses_thermal")));
  if (frame == PoseFrame::own) return nerf::Field();
  return nerf::Field::load(context.of("train_visible") / field_file);
}

void move_to(const std::map<std::string, Rigid3d>& refined, Reconstruction& model) {
  for (PosedView& view : model.views)
    if (const auto found = refined.find(view.name); found != refined.end())
      view.cam_from_world = found->second;
}

/// Keeps the poses that training ended with, if it moved them: those of all posed views.
Status take_refined_poses(const nerf::TrainReport& report, const StageContext& context,
                          const Session& session, Reconstruction& model) {
  if (report.refined_poses.empty()) return {};
  move_to(report.refined_poses, model);
  ORBITFUSE_ASSIGN(
      Reconstruction all,
      load_poses(context.of("poses_" + std::string(name(model.modality))), model.modality));
  move_to(report.refined_poses, all);
  all.points.clear();  // they were where the views had been
  return save_poses(context, session, all);
}

/// Raw counts of one thermal camera in one scale: a recording that was resumed stretches them anew,
/// and says so each time.
bool all_are_counts(const Session& session, Modality modality) {
  const auto frames = session.frames_of(modality, false);
  const auto stretches = std::count_if(
      session.events.begin(), session.events.end(),
      [](const EventRecord& event) { return event.kind == name(EventKind::raw_counts); });
  return stretches <= 1 && !frames.empty() &&
         std::all_of(frames.begin(), frames.end(), [&](const FrameRecord* f) {
           return f->has_flag(FrameFlag::raw_counts) && f->device == frames.front()->device;
         });
}

Result<StageOutput> train(const StageContext& context, const SessionInput& input,
                          const TrainConfig& config, Modality modality, const json& resolved,
                          nerf::KeptRenders* kept) {
  ORBITFUSE_ASSIGN(LearnedViews learned, learned_views(context, modality));
  Reconstruction& model = learned.model;
  ORBITFUSE_ASSIGN(nerf::Dataset data,
                   training_data(input.session.folder, model, input.samples(model.modality),
                                 config.max_width_px, context.progress));
  data.counts = all_are_counts(input.session, modality);
  if (modality == Modality::visible && context.has("depth")) {
    ORBITFUSE_ASSIGN(std::vector<DepthMap> maps, load_depth_maps(context.of("depth")));
    data.depth = of_learned(std::move(maps), learned);
  }
  nerf::TrainOptions options = config.options;
  StageOutput output;
  if (const std::vector<std::string>& left_out = learned.left_out; !left_out.empty())
    output.skips.push_back({fmt::format("{} posed photos", left_out.size()),
                            "in doubt: " + first_names(left_out, 4),
                            fmt::format("the field learns from the other {}", model.views.size())});
  nerf::Field guide;
  if (modality == Modality::thermal && options.shared_geometry) {
    ORBITFUSE_ASSIGN(guide, guide_field(context));
    if (guide.empty()) {
      options.shared_geometry = false;
      output.skips.push_back({"shared geometry", "no visible field in the same frame",
                              "the thermal field learns its own density"});
    }
  }
  ThermalDepth own_depth;
  if (modality == Modality::thermal && guide.empty() && config.depth_width_px > 0 &&
      options.depth_weight > 0) {
    ORBITFUSE_ASSIGN(own_depth,
                     add_thermal_depth(data, config.depth_width_px, options.holdout_every,
                                       options.seed, context.progress));
    if (own_depth.problem)
      output.skips.push_back(
          {"depth of the thermal views", *own_depth.problem, "the field learns from images alone"});
  }
  options.checkpoint = context.folder / "checkpoint.bin";
  options.resume = true;  // where there is a checkpoint: of an interrupted attempt, or to extend
  if (!std::filesystem::exists(options.checkpoint)) {
    ORBITFUSE_ASSIGN(const int done, extend_training(context, resolved, options.checkpoint));
    if (done > 0)
      output.skips.push_back(
          {fmt::format("the first {} steps", done),
           "the last result has them, and only the length of the run has changed",
           "training goes on from there; --force starts from nothing"});
  }

  nerf::Field field;
  ORBITFUSE_ASSIGN(
      const nerf::TrainReport report,
      nerf::train(data, options, context.progress, field, guide.empty() ? nullptr : &guide));
  ORBITFUSE_TRY(write_json(context.folder / "curve.json", curve_json(report)));
  ORBITFUSE_TRY(take_refined_poses(report, context, input.session, model));
  std::size_t cloud_points = 0;
  const auto export_cloud = [&]() -> Status {
    const auto cloud =
        nerf::export_point_cloud(field, model.views, config.cloud, context.progress, kept);
    if (!cloud && cloud.error().kind == ErrorKind::quality) {
      output.warnings.push_back("no point cloud: " + cloud.error().message());
      return {};
    }
    if (!cloud) return tl::unexpected(cloud.error());
    cloud_points = cloud->size();
    return write_ply(context.folder / cloud_file, *cloud);
  };
  // The disk takes its time over a field.
  ORBITFUSE_TRY(
      side_by_side({export_cloud, [&] { return field.save(context.folder / field_file); }}));
  std::error_code ignored;
  std::filesystem::remove(options.checkpoint, ignored);

  output.skips.insert(output.skips.end(), report.skips.begin(), report.skips.end());
  output.warnings.insert(output.warnings.end(), report.warnings.begin(), report.warnings.end());
  if (report.skipped_steps > 0)
    output.warnings.push_back(
        fmt::format("{} training steps dropped: a gradient was not finite", report.skipped_steps));
  output.metrics = metrics_json(report);
  if (!report.device.empty()) output.metrics["device"] = report.device;
  if (own_depth.known > 0) output.metrics["own_depth_known"] = own_depth.known;
  output.metrics["cloud_points"] = cloud_points;
  output.metrics["width_px"] = data.views.empty() ? 0 : data.views[0].camera.width;
  return output;
}

}  // namespace

pipeline::Stage train_stage(const StageInputs& in, Modality modality) {
  const std::string modality_name(name(modality));
  const bool visible = modality == Modality::visible;
  pipeline::Stage stage;
  stage.name = "train_" + modality_name;
  // Thermal fields without a guide match their own depth: theirs rises with the depth stage's, too.
  stage.version = visible ? 7 : 12;
  stage.needs = {"poses_" + modality_name};
  stage.uses = {visible ? "depth" : "train_visible"};
  stage.options = in.config->settings().to_json("train." + modality_name);
  stage.options["seed"] = in.config->seed;
  stage.inputs_hash = in.session->content.at(modality);
  stage.run = [in, modality, options = stage.options](const StageContext& context) {
    return train(context, *in.session, in.config->train(modality), modality, options,
                 in.where_frames_stand.get());
  };
  return stage;
}

}  // namespace orbitfuse::stages
