// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/finished_run.hpp"

#include <fmt/format.h>

#include "app/pipeline/stage_record.hpp"
#include "app/stages/artifacts.hpp"
#include "app/stages/measurement_scene.hpp"
#include "app/stages/recorded_detail.hpp"
#include "app/stages/rendered_views.hpp"
#include "app/stages/stage_list.hpp"
#include "app/view/surface.hpp"
#include "core/formats/ply.hpp"
#include "core/geometry/scene_ball.hpp"
#include "core/system/file_io.hpp"
#include "recon/assembly/new_views.hpp"

namespace orbitfuse::view {
namespace fs = std::filesystem;
namespace {

constexpr int picture_width_px = 640;  ///< of the viewer's

Result<std::string> identity_of(const pipeline::StageContext& context) {
  std::string made_of;
  for (const char* stage :
       {"poses_visible", "poses_thermal", "train_visible", "train_thermal", "register"}) {
    if (!context.has(stage)) continue;
    ORBITFUSE_ASSIGN(const pipeline::StageRecord record,
                     pipeline::read_stage_record(context.of(stage)));
    made_of += stage + (" " + record.outputs_hash()) + "\n";
  }
  return content_hash(made_of);
}

Status load_fields(const pipeline::StageContext& context, FinishedRun& run) {
  if (context.has("train_visible")) {
    ORBITFUSE_ASSIGN(run.visible,
                     nerf::Field::load(context.of("train_visible") / stages::field_file));
  }
  if (context.has("train_thermal")) {
    ORBITFUSE_ASSIGN(run.thermal,
                     nerf::Field::load(context.of("train_thermal") / stages::field_file));
  }
  if (run.visible.empty() && run.thermal.empty())
    return fail(
        ErrorKind::input, context.out.string(), "no trained field in it",
        "name the --out folder of a run, or finish it: orbitfuse run " + context.out.string());
  if (run.visible.empty() || run.thermal.empty())
    run.notes.push_back(run.visible.empty() ? "the run has no visible field"
                                            : "the run has no thermal field");
  else if (!context.has("register")) {
    run.thermal = nerf::Field();
    run.notes.push_back("the thermal field is not shown: nothing relates it to the visible one");
  }
  if (!run.thermal.empty()) {
    ORBITFUSE_ASSIGN(run.frame_from_thermal, stages::load_world_from_thermal(context));
  }
  run.frame = run.visible.empty() && !stages::is_in_visible_world(context) ? Modality::thermal
                                                                           : Modality::visible;
  return {};
}

Status load_views(const pipeline::StageContext& context, FinishedRun& run) {
  if (run.has(Modality::thermal)) {
    auto trained = stages::load_trained_frames(context.of("train_thermal"));
    if (trained) {
      run.shading_k = trained->shading_k;
      run.gray_curves = std::move(trained->gray_curves);
    } else {
      run.notes.push_back("thermal photos are shown as recorded, not as the field learned them: " +
                          trained.error().message());
    }
  }
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const std::string stage = "poses_" + std::string(name(modality));
    if (!run.has(modality) || !context.has(stage)) continue;
    ORBITFUSE_ASSIGN(const Reconstruction model, stages::load_trained_poses(context, modality));
    ORBITFUSE_ASSIGN(const auto doubts, stages::load_doubts(context.of(stage)));
    for (const PosedView& posed : model.views) {
      RecordedView recorded{modality, posed, {}};
      if (modality != run.frame)
        recorded.view.cam_from_world = rebase(posed.cam_from_world, run.frame_from_thermal);
      if (const auto doubt = doubts.find(posed.name); doubt != doubts.end())
        recorded.doubt = doubt->second;
      run.views.push_back(std::move(recorded));
    }
  }
  return {};
}

/// The session that the run names, if it is there and still the one that the run was made of.
Result<Session> session_of(const pipeline::StageContext& context, const nlohmann::json& record) {
  const auto folder = record.find("session");
  if (folder == record.end() || !folder->is_string())
    return fail(ErrorKind::input, (context.out / "run.json").string(), "no session named in it",
                "run again");
  ORBITFUSE_ASSIGN(Session session, open_session(folder->get<std::string>()));
  for (const Modality modality : {Modality::visible, Modality::thermal})
    ORBITFUSE_TRY(stages::check_session_of_run(context, session, modality));
  return session;
}

/// Without it pictures show the fields alone.
void load_detail(const pipeline::StageContext& context, FinishedRun& run) {
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    if (!run.session || !run.has(modality)) continue;
    auto detail = stages::detail_of_new_views(context, *run.session, modality,
                                              stages::detail_width_px(picture_width_px));
    if (detail)
      (modality == Modality::visible ? run.visible_detail : run.thermal_detail) =
          *std::move(detail);
    else
      run.notes.push_back(fmt::format("pictures are without the detail of the {} frames: {}",
                                      name(modality), detail.error().message()));
  }
}

/// Round what the camera of the viewer turns.
void set_orbit(FinishedRun& run) {
  std::vector<PosedView> of_frame;
  std::vector<Rigid3d> poses;
  for (const RecordedView& v : run.views) {
    if (v.modality == run.frame || !run.has(run.frame)) of_frame.push_back(v.view);
    poses.push_back(v.view.cam_from_world);
  }
  if (const auto orbit = orbit_geometry(of_frame)) {
    run.center = orbit->center;
    run.up = orbit->up;
    run.radius = orbit->radius;
    return;
  }
  const SceneBall ball = scene_ball(poses, run.surface.positions);
  run.center = ball.center;
  run.radius = ball.radius;
}

Result<PointCloud> cloud_of(const pipeline::StageContext& context, const std::string& stage) {
  const fs::path file = context.of(stage) / stages::cloud_file;
  std::error_code unreadable;
  if (!context.has(stage) || !fs::exists(file, unreadable)) return PointCloud();
  return read_ply(file);
}

Status load_surface(const pipeline::StageContext& context, FinishedRun& run) {
  PointCloud visible, thermal;
  if (run.has(Modality::visible)) {
    ORBITFUSE_ASSIGN(visible, cloud_of(context, "train_visible"));
  }
  if (run.has(Modality::thermal)) {
    ORBITFUSE_ASSIGN(thermal, cloud_of(context, "train_thermal"));
  }
  for (Eigen::Vector3d& p : thermal.positions) p = run.frame_from_thermal * p;
  run.surface = surface_of(visible, std::move(thermal));
  if (run.surface.empty())
    run.notes.push_back(
        "the run has no point cloud: while the camera moves there is nothing to see");
  return {};
}

Status load_scales(const pipeline::StageContext& context, FinishedRun& run) {
  if (run.session) {
    for (const FrameRecord& frame : run.session->frames)
      run.thermal_is_gray |= frame.modality == Modality::thermal && frame.thermal_is_gray;
  }
  if (context.has("render")) {
    ORBITFUSE_ASSIGN(const stages::RenderedViews rendered,
                     stages::load_rendered_views(context.of("render")));
    run.span = rendered.span;
    run.heat = rendered.heat;
    run.thermal_is_gray = rendered.thermal_is_gray;
    if (run.heat.is_valid() && run.span.high_k > run.span.low_k) return {};
  }
  const std::vector<float>& t = run.surface.temperatures_k;
  const cv::Mat samples = t.empty() ? cv::Mat(1, 1, CV_32FC1, cv::Scalar(0)) : cv::Mat(t, true);
  run.span = common_span({samples});
  run.heat = heat_scale({samples}, stages::heat_scale_options(run.samples()));
  return {};
}

}  // namespace

Result<std::string> identity_of_run(const fs::path& out) {
  return identity_of(stages::context_of_run(out));
}

Result<FinishedRun> load_finished_run(const fs::path& out, const stages::RunConfig& config,
                                      const Progress& progress) {
  std::error_code unreadable;
  if (!fs::exists(out / "run.json", unreadable))
    return unreadable
               ? fail(ErrorKind::input, out.string(), unreadable.message(), "check its permissions")
               : fail(ErrorKind::input, out.string(), "no finished run in it (no run.json)",
                      "name the --out folder of orbitfuse run");
  FinishedRun run;
  run.out = out;
  run.config = config;
  const pipeline::StageContext context = stages::context_of_run(out);
  ORBITFUSE_TRY(stages::check_up_to_date(out));
  ORBITFUSE_ASSIGN(run.identity, identity_of(context));
  ORBITFUSE_TRY(load_fields(context, run));
  ORBITFUSE_TRY(stages::check_as_written(context));
  ORBITFUSE_TRY(progress.check("view"));
  ORBITFUSE_ASSIGN(const auto record, stages::read_json(out / "run.json"));
  auto session = session_of(context, record);
  if (session)
    run.session = *std::move(session);
  else
    run.notes.push_back("photos cannot be shown: " + session.error().message());
  ORBITFUSE_TRY(load_views(context, run));
  load_detail(context, run);
  ORBITFUSE_TRY(load_surface(context, run));
  ORBITFUSE_TRY(progress.check("view"));
  set_orbit(run);
  ORBITFUSE_TRY(load_scales(context, run));
  return run;
}

}  // namespace orbitfuse::view
