// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/measurement_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <set>

#include "app/pipeline/stage_record.hpp"
#include "app/stages/artifacts.hpp"
#include "app/stages/metric_scale.hpp"
#include "app/stages/rendered_views.hpp"
#include "app/stages/session_input.hpp"
#include "app/stages/stage_list.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "recon/measurement/field_source.hpp"

namespace orbitfuse::stages {
namespace {
namespace fs = std::filesystem;
using measurement::SceneParts;
using measurement::ThermalFrame;
using measurement::ThermalScene;

/// The thermal field, its frames, and how both come into the run's world.
Status add_thermal(const pipeline::StageContext& context, const Session& session,
                   SceneParts& parts) {
  ORBITFUSE_ASSIGN(nerf::Field field, nerf::Field::load(context.of("train_thermal") / field_file));
  ORBITFUSE_ASSIGN(const Similarity3d world_from_thermal, load_world_from_thermal(context));
  const auto shared = std::make_shared<const nerf::Field>(std::move(field));
  parts.field = measurement::field_renderer(shared, world_from_thermal);
  ORBITFUSE_ASSIGN(const Reconstruction model, load_trained_poses(context, Modality::thermal));
  ORBITFUSE_ASSIGN(const auto doubts, load_doubts(context.of("poses_thermal")));
  for (PosedView view : model.views) {
    view.cam_from_world = rebase(view.cam_from_world, world_from_thermal);
    ThermalFrame frame{std::move(view), {}, {}};
    if (const auto doubt = doubts.find(frame.view.name); doubt != doubts.end())
      frame.doubt = doubt->second;
    const auto record =
        std::find_if(session.frames.begin(), session.frames.end(), [&](const FrameRecord& r) {
          return r.modality == Modality::thermal && r.file == frame.view.name;
        });
    // Its name becomes a path in the session's folder, so it must be one that the session lists.
    if (record == session.frames.end())
      return fail(ErrorKind::input, frame.view.name,
                  "a posed view that is no thermal frame of " + session.folder.string(),
                  "name the session of that run, or run this one again");
    frame.radiometry = record->radiometry;
    if (!frame.doubtful()) parts.surface.views.push_back(frame.view);
    parts.frames.push_back(std::move(frame));
  }
  parts.surface.depth = measurement::surface_renderer(shared, world_from_thermal);
  ORBITFUSE_ASSIGN(const TrainedFrames trained, load_trained_frames(context.of("train_thermal")));
  parts.read_frame = [root = session.folder,
                      shading_k = trained.shading_k](const ThermalFrame& frame) -> Result<cv::Mat> {
    ORBITFUSE_ASSIGN(cv::Mat kelvin, read_thermal_k(root / frame.view.name));
    if (shading_k != 0) kelvin -= nerf::shading_image(shading_k, kelvin.size());
    return kelvin;
  };
  return {};
}

/// The visible field's surface in place of the thermal one's, which has no fine form. It is read
/// when the first distance is asked for.
Status add_visible_surface(const pipeline::StageContext& context, SceneParts& parts) {
  if (!is_in_visible_world(context) || !context.has("train_visible")) return {};
  struct Loaded {
    std::once_flag once;
    Result<measurement::DepthRenderer> depth;
  };
  parts.surface.depth = [file = context.of("train_visible") / field_file,
                         loaded = std::make_shared<Loaded>()](
                            const Camera& camera, const Rigid3d& cam_from_world,
                            const Progress& progress) -> Result<cv::Mat> {
    std::call_once(loaded->once, [&] {
      loaded->depth = nerf::Field::load(file).map([](nerf::Field&& field) {
        return measurement::surface_renderer(std::make_shared<const nerf::Field>(std::move(field)),
                                             Similarity3d());
      });
    });
    if (!loaded->depth) return tl::unexpected(loaded->depth.error());
    return (*loaded->depth)(camera, cam_from_world, progress);
  };
  ORBITFUSE_ASSIGN(const Reconstruction model, load_trained_poses(context, Modality::visible));
  ORBITFUSE_ASSIGN(const auto doubts, load_doubts(context.of("poses_visible")));
  parts.surface.views.clear();
  for (const PosedView& view : model.views)
    if (!doubts.contains(view.name)) parts.surface.views.push_back(view);
  return {};
}

Status add_named_views(const pipeline::StageContext& context, SceneParts& parts) {
  for (const ThermalFrame& frame : parts.frames) parts.orbit.push_back(frame.view);
  if (context.has("poses_visible")) {
    // Those that the field was trained with: its depth is along their rays.
    ORBITFUSE_ASSIGN(const Reconstruction visible,
                     context.has("train_visible")
                         ? load_trained_poses(context, Modality::visible)
                         : load_poses(context.of("poses_visible"), Modality::visible));
    parts.views = parts.orbit = visible.views;
    ORBITFUSE_ASSIGN(const auto doubts, load_doubts(context.of("poses_visible")));
    for (const auto& [view, why] : doubts) parts.doubtful_views.insert(view);
  }
  if (!context.has("render")) return {};
  ORBITFUSE_ASSIGN(const RenderedViews rendered, load_rendered_views(context.of("render")));
  if (!pipeline::out_of_date(context.out, {"render"}).empty()) {
    for (const ViewFiles& view : rendered.views) parts.outdated.push_back(view.name);
    return {};
  }
  ORBITFUSE_ASSIGN(const Transforms transforms,
                   read_transforms_json(context.of("render") / "transforms.json"));
  for (std::size_t i = 0; i < std::min(rendered.views.size(), transforms.frames.size()); ++i)
    parts.views.push_back(
        {rendered.views[i].name, transforms.frames[i].camera, transforms.frames[i].cam_from_world});
  return {};
}

void add_unposed(const Session& session, SceneParts& parts) {
  std::set<std::string> posed;
  for (const ThermalFrame& frame : parts.frames) posed.insert(frame.view.name);
  for (const PosedView& view : parts.views) posed.insert(view.name);
  for (const FrameRecord& frame : session.frames)
    if (!posed.contains(frame.file)) parts.unposed.push_back(frame.file);
}

/// Of everything that a measurement's coordinates and temperatures depend on.
Result<std::string> identity_of(const pipeline::StageContext& context, const Session& session) {
  std::string text = session.id;
  for (const char* stage : {"poses_visible", "poses_thermal", "train_thermal", "register"}) {
    if (!context.has(stage)) continue;
    ORBITFUSE_ASSIGN(const pipeline::StageRecord record,
                     pipeline::read_stage_record(context.of(stage)));
    text += " " + record.outputs_hash();
  }
  return content_hash(text);
}

}  // namespace

Status check_session_of_run(const pipeline::StageContext& context, const Session& session,
                            Modality modality) {
  const std::string stage = "poses_" + std::string(name(modality));
  if (!context.has(stage)) return {};
  ORBITFUSE_ASSIGN(const pipeline::StageRecord record,
                   pipeline::read_stage_record(context.of(stage)));
  const auto outside = record.inputs.find("outside");
  if (outside == record.inputs.end()) return {};
  ORBITFUSE_ASSIGN(const std::string content, modality_content(session, modality));
  if (content == outside->second) return {};
  return fail(ErrorKind::input, session.folder.string(),
              fmt::format("its {} frames are not those that {} was made of", name(modality),
                          context.out.string()),
              "name the session of that run, or run this one again");
}

bool is_in_visible_world(const pipeline::StageContext& context) {
  return context.has("poses_visible") && context.has("register");
}

Result<Similarity3d> load_world_from_thermal(const pipeline::StageContext& context) {
  if (!is_in_visible_world(context)) return Similarity3d();
  ORBITFUSE_ASSIGN(const RegistrationRecord record, load_registration(context.of("register")));
  return record.visible_from_thermal;
}

Result<std::string> measurement_identity(const fs::path& out, const Session& session) {
  return identity_of(context_of_run(out), session);
}

Result<ThermalScene> load_measurement_scene(const fs::path& out, const Session& session,
                                            const measurement::MeasurementOptions& options) {
  const pipeline::StageContext context = context_of_run(out);
  if (session.frames_of(Modality::thermal).empty())
    return fail(ErrorKind::input, session.folder.string(), "the session has no thermal frames",
                "temperatures are measured in sessions that have some: import --thermal");
  for (const char* stage : {"poses_thermal", "train_thermal"})
    if (!context.has(stage))
      return fail(ErrorKind::input, out.string(), std::string(stage) + " is not finished in it",
                  "run the session first: orbitfuse run " + session.folder.string() + " --out " +
                      out.string());
  ORBITFUSE_TRY(check_up_to_date(out));
  // Two fields whose frames nobody could relate have no world in common.
  if (context.has("poses_visible") && !context.has("register"))
    return fail(ErrorKind::input, out.string(), "the two fields are not registered",
                "see why in " + (out / "register.failed").string() + " or the report");
  const auto frames = session.frames_of(Modality::thermal);
  if (std::any_of(frames.begin(), frames.end(),
                  [](const FrameRecord* f) { return f->thermal_is_gray; }))
    return fail(ErrorKind::input, session.folder.string(),
                "its thermal frames are gray levels, no temperatures",
                "record with a camera that gives temperatures, or import its radiometric files");
  ORBITFUSE_TRY(check_session_of_run(context, session, Modality::thermal));
  SceneParts parts;
  ORBITFUSE_TRY(add_thermal(context, session, parts));
  ORBITFUSE_TRY(check_as_written(context));
  ORBITFUSE_TRY(add_visible_surface(context, parts));
  ORBITFUSE_TRY(add_named_views(context, parts));
  add_unposed(session, parts);
  ORBITFUSE_ASSIGN(parts.identity, identity_of(context, session));
  ORBITFUSE_ASSIGN(const auto scale, scale_of_run(out));
  if (scale) {
    parts.metres_per_unit = scale->metres_per_unit;
    parts.scale_relative_sigma = scale->relative_uncertainty;
  }
  return ThermalScene::make(std::move(parts), options);
}

}  // namespace orbitfuse::stages
