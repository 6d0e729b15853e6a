// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate_poses.hpp"

#include <fmt/format.h>

#include "app/stages/artifacts.hpp"
#include "app/stages/learned_views.hpp"
#include "app/stages/stage_list.hpp"
#include "core/image/image_io.hpp"
#include "core/image/palette.hpp"
#include "core/numeric/median.hpp"
#include "recon/assembly/field_renderer.hpp"
#include "recon/nerf/nerf.hpp"

namespace orbitfuse::stages {
namespace {
using nlohmann::json;
using pipeline::StageContext;
using pipeline::StageOutput;

json ladder_json(const std::vector<LadderStep>& ladder) {
  json list = json::array();
  for (const LadderStep& step : ladder)
    list.push_back({{"attempt", step.attempt},
                    {"held", step.held},
                    {"bettered", step.bettered},
                    {"why", step.why},
                    {"posed", step.posed},
                    {"total", step.total},
                    {"seconds", step.seconds}});
  return list;
}

std::string held_attempt(const ModalityPoses& poses) {
  for (const LadderStep& step : poses.ladder)
    if (step.held) return step.attempt;
  return "no attempt";
}

/// Views of one lens share it; of several this is one in the middle.
double median_focal_px(const std::vector<PosedView>& views) {
  std::vector<double> focal_px;
  for (const PosedView& view : views) focal_px.push_back(view.camera.fx);
  return median(std::move(focal_px));
}

StageOutput describe(const ModalityPoses& poses, PoseFrame frame) {
  StageOutput output;
  json dropped = json::array();
  for (const DroppedView& view : poses.dropped) {
    dropped.push_back({{"view", view.name}, {"why", view.why}});
    output.warnings.push_back(view.name + " has no pose: " + view.why);
  }
  json doubtful = json::array();
  for (const DoubtfulView& view : poses.doubtful) {
    doubtful.push_back({{"view", view.name}, {"reason", name(view.reason)}, {"why", view.why}});
    output.warnings.push_back(view.name + " may be misplaced: " + view.why);
  }
  output.warnings.insert(output.warnings.end(), poses.warnings.begin(), poses.warnings.end());
  const std::size_t posed = poses.reconstruction.views.size();
  output.skips = poses.skips;
  const std::string doubts =
      poses.doubtful.empty() ? "" : fmt::format(", {} of them doubtful", poses.doubtful.size());
  output.metrics = {{"brief", fmt::format("{} of {} views posed{} ({})", posed, poses.frame_count,
                                          doubts, held_attempt(poses))},
                    {"posed", posed},
                    {"total", poses.frame_count},
                    {"attempt", held_attempt(poses)},
                    {"ladder", ladder_json(poses.ladder)},
                    {"dropped", dropped},
                    {"doubtful", doubtful},
                    {"sure", posed - poses.doubtful.size()},
                    {"reprojection_rms_px", poses.reprojection_rms_px},
                    {"points", poses.reconstruction.points.size()},
                    {"shared_frame", frame == PoseFrame::visible},
                    {"gates", poses.gates}};
  if (posed > 0) output.metrics["focal_px"] = median_focal_px(poses.reconstruction.views);
  return output;
}

/// The thermal span of the session, for tools that read temperature_bounds.json.
Status save_session_bounds(const StageContext& context, const SessionInput& input,
                           const Reconstruction& model) {
  if (!input.has_temperatures()) return {};
  std::vector<cv::Mat> frames;
  for (const PosedView& view : model.views) {
    ORBITFUSE_ASSIGN(cv::Mat kelvin, read_thermal_k(input.session.folder / view.name));
    frames.push_back(std::move(kelvin));
  }
  const TemperatureSpan span = common_span(frames, 0, 100);
  return save_temperature_bounds(context.folder, span.low_k, span.high_k);
}

Result<StageOutput> finish(const StageContext& context, const Session& session,
                           const ModalityPoses& poses, PoseFrame frame) {
  ORBITFUSE_TRY(save_poses(context, session, poses.reconstruction));
  std::vector<std::string> doubtful;
  for (const DoubtfulView& view : poses.doubtful) doubtful.push_back(view.name);
  ORBITFUSE_TRY(save_pose_frame(context.folder, frame, doubtful));
  std::error_code ignored;
  std::filesystem::remove_all(context.folder / "work", ignored);
  return describe(poses, frame);
}

Result<StageOutput> pose_visible(const StageContext& context, const SessionInput& input,
                                 const PoseOptions& options) {
  ORBITFUSE_ASSIGN(
      const ModalityPoses poses,
      estimate_visible_poses(input.session, options, context.folder / "work", context.progress));
  return finish(context, input.session, poses, PoseFrame::visible);
}

Result<StageOutput> pose_thermal(const StageContext& context, const SessionInput& input,
                                 const PoseOptions& options) {
  VisibleScene scene;
  const bool visible = context.has("poses_visible");
  if (visible) {
    ORBITFUSE_ASSIGN(LearnedViews learned, learned_views(context, Modality::visible));
    scene.reconstruction = std::move(learned.model);
    ORBITFUSE_ASSIGN(scene.doubts, load_doubts(context.of("poses_visible")));
    if (!learned.left_out.empty()) {
      ORBITFUSE_ASSIGN(scene.posed, load_poses(context.of("poses_visible"), Modality::visible));
    }
  }
  nerf::Field field;
  if (context.has("train_visible")) {
    ORBITFUSE_ASSIGN(field, nerf::Field::load(context.of("train_visible") / field_file));
    scene.renderer = edge_renderer(field, context.progress);
  }
  ORBITFUSE_ASSIGN(const ThermalPoses poses,
                   estimate_thermal_poses(input.session, visible ? &scene : nullptr, options,
                                          context.folder / "work", context.progress));
  ORBITFUSE_TRY(save_session_bounds(context, input, poses.reconstruction));
  return finish(context, input.session, poses,
                poses.shares_visible_frame ? PoseFrame::visible : PoseFrame::own);
}

}  // namespace

pipeline::Stage poses_stage(const StageInputs& in, Modality modality) {
  const bool visible = modality == Modality::visible;
  pipeline::Stage stage;
  stage.name = "poses_" + std::string(name(modality));
  stage.version = 26;  // joints of points that three views see
  if (!visible) {
    stage.version = 31;  // rigs of the usual camera; order before COLMAP alone
    stage.uses = {"poses_visible"};
    if (asks_for_renders(in.session->session, in.config->poses))
      stage.uses.push_back("train_visible");
  }
  stage.options = in.config->settings().to_json("poses");
  if (visible) stage.options.erase("check_mirrored");  // asked of thermal images alone
  stage.options["seed"] = in.config->seed;
  // Names and times of photos, and what the user said of the cameras, are in no frame's content.
  if (!visible)
    if (const std::string rig = described_rig(in.session->session); !rig.empty())
      stage.options["rig"] = rig;
  if (!visible)
    if (const std::string declared = declared_stations_of_photos(in.session->session);
        !declared.empty())
      stage.options["stations_of_photos"] = declared;
  stage.inputs_hash = in.session->content.at(modality);
  if (!in.session->has(modality))
    stage.pointless = fmt::format("the session has no {} frames", name(modality));
  stage.run = [in, visible](const StageContext& context) {
    return visible ? pose_visible(context, *in.session, in.config->poses)
                   : pose_thermal(context, *in.session, in.config->poses);
  };
  return stage;
}

}  // namespace orbitfuse::stages
