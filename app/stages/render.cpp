// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "app/stages/artifacts.hpp"
#include "app/stages/given_cameras.hpp"
#include "app/stages/learned_views.hpp"
#include "app/stages/recorded_detail.hpp"
#include "app/stages/rendered_views.hpp"
#include "app/stages/stage_list.hpp"
#include "app/stages/unseen_views.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/image/image_io.hpp"
#include "core/image/palette.hpp"
#include "core/system/clock.hpp"
#include "core/system/file_io.hpp"
#include "core/system/side_by_side.hpp"
#include "core/system/trace.hpp"
#include "fusion/heat/heat.hpp"
#include "recon/assembly/field_renderer.hpp"
#include "recon/assembly/looked_at.hpp"
#include "recon/nerf/nerf.hpp"

namespace orbitfuse::stages {
namespace {
using nlohmann::json;
using pipeline::StageContext;
using pipeline::StageOutput;

struct Fields {
  DetailedField visible, thermal;
  Similarity3d visible_from_thermal;
};

Result<Fields> load_fields(const StageContext& context) {
  Fields fields;
  if (context.has("train_visible")) {
    ORBITFUSE_ASSIGN(fields.visible.field,
                     nerf::Field::load(context.of("train_visible") / field_file));
  }
  if (context.has("train_thermal")) {
    ORBITFUSE_ASSIGN(fields.thermal.field,
                     nerf::Field::load(context.of("train_thermal") / field_file));
  }
  if (!fields.visible.empty() && !fields.thermal.empty() && context.has("register")) {
    ORBITFUSE_ASSIGN(const RegistrationRecord record, load_registration(context.of("register")));
    fields.visible_from_thermal = record.visible_from_thermal;
  }
  // Two fields whose frames nobody could relate can't be shown by one camera.
  if (!fields.visible.empty() && !context.has("register")) fields.thermal = {};
  return fields;
}

Status load_detail(const StageContext& context, const StageInputs& in, const NewViews& views,
                   Fields& fields, StageOutput& output) {
  const nerf::DetailOptions& options = in.config->render.detail;
  int widest = 0;
  for (const PosedView& view : views.views) widest = std::max(widest, view.camera.width);
  const auto load = [&](DetailedField& shown) -> Status {
    if (shown.empty()) return {};
    const Modality modality = shown.field.modality();
    ORBITFUSE_ASSIGN(shown.detail,
                     recorded_detail(context, in.session->session, modality,
                                     detail_width_px(widest), options, in.where_frames_stand));
    if (shown.detail.empty()) return {};
    context.progress.report({"render", 0, 1, {}, "detail of the recorded frames"});
    ORBITFUSE_ASSIGN(shown.trial, try_on_recorded(context, shown));
    const nerf::DetailTrial& trial = shown.trial;
    if (!trial.helps()) shown.detail = {};
    output.metrics[detail_key(modality)] = {{"sources", shown.detail.empty() ? 0 : options.sources},
                                            {"views_tried", trial.views},
                                            {"error_without", trial.without},
                                            {"error_with", trial.with}};
    if (shown.detail.empty())
      output.skips.push_back({fmt::format("detail of the {} frames in new views", name(modality)),
                              trial.views > 0
                                  ? fmt::format("{} recorded ones (their middle halves) are {:.1f} "
                                                "% of the range off with it, "
                                                "{:.1f} without",
                                                trial.views, 100 * trial.with, 100 * trial.without)
                                  : "there is no recorded view to try it on",
                              "new views show the field alone"});
    return {};
  };
  ORBITFUSE_TRY(load(fields.visible));
  return load(fields.thermal);
}

/// ", with detail of recorded frames (2 tried: 16 % nearer)"; empty where there is none.
std::string words_on_detail(const Fields& fields) {
  for (const DetailedField* shown : {&fields.visible, &fields.thermal}) {
    if (shown->detail.empty()) continue;
    const nerf::DetailTrial& trial = shown->trial;
    return fmt::format(", with detail of recorded frames ({} tried: {:.0f} % nearer)", trial.views,
                       100 * (1 - trial.with / trial.without));
  }
  return {};
}

Result<GivenCameras> choose_views(const StageContext& context, const RenderConfig& config,
                                  Modality frame) {
  if (config.cameras.empty()) {
    ORBITFUSE_ASSIGN(const LearnedViews learned, learned_views(context, frame));
    ORBITFUSE_ASSIGN(NewViews views, new_views(learned.model.views, config.path));
    return GivenCameras{std::move(views), {}};
  }
  return read_given_cameras(config.cameras);
}

/// What the views that the field of `frame` learned from saw of it.
Result<UnseenViews> recorded_views_of(const StageContext& context, const Fields& fields,
                                      Modality frame) {
  const TraceSpan span("what recorded views saw");
  const DetailedField& shown = frame == Modality::visible ? fields.visible : fields.thermal;
  ORBITFUSE_ASSIGN(Reconstruction posed, load_trained_poses(context, frame));
  ORBITFUSE_ASSIGN(const LearnedViews learned, learned_views(context, frame));
  std::erase_if(posed.views, [&](const PosedView& view) {
    return std::count(learned.left_out.begin(), learned.left_out.end(), view.name) > 0;
  });
  ORBITFUSE_ASSIGN(SeenBefore seen,
                   SeenBefore::of(depth_renderer(shown.field, context.progress), posed.views));
  return UnseenViews(std::move(seen));
}

/// Where a ray met nothing the field knows, there is no temperature.
cv::Mat masked(const cv::Mat& kelvin, const cv::Mat& opacity, double min_opacity) {
  cv::Mat result = kelvin.clone();
  result.setTo(std::numeric_limits<float>::quiet_NaN(), opacity < min_opacity);
  return result;
}

/// What colours stand for in all pictures of the run: the span of the object that was gone round,
/// and what is warm against its surroundings.
Status choose_scales(const StageContext& context, Modality frame,
                     const std::vector<ThermalView>& seen, RenderedViews& rendered) {
  ORBITFUSE_ASSIGN(const LearnedViews learned, learned_views(context, frame));
  const std::vector<PosedView>& posed = learned.model.views;
  const TemperatureSpan object = object_span(seen, posed);
  const HeatScaleOptions how = heat_scale_options(rendered.samples());
  rendered.heat = heat_scale(within_orbit(seen, posed, surroundings_reach), how);
  rendered.heat.hot = object.high_k;
  rendered.heat = within_levels(rendered.heat, how);
  rendered.span = rendered.thermal_is_gray ? TemperatureSpan{0, 255} : object;
  return {};
}

/// All views in one scale of counts, which the hottest of them decides, and in one palette.
Status write_temperatures(const StageContext& context, const std::vector<ThermalView>& temperatures,
                          const RenderedViews& rendered, const std::string& palette_name,
                          std::vector<ViewFiles>& files) {
  ORBITFUSE_ASSIGN(const cv::Mat colors, palette(palette_name));
  std::vector<cv::Mat> kelvin;
  for (const ThermalView& view : temperatures) kelvin.push_back(view.thermal);
  const double kelvin_per_count = kelvin_per_count_for(kelvin);
  std::vector<std::function<Status()>> writes;
  for (std::size_t i = 0; i < files.size(); ++i) {
    files[i].palette = "palette/" + files[i].name + ".png";
    writes.emplace_back([&, i] {
      cv::Mat painted = colorize(kelvin[i], rendered.span, colors);
      fusion::hatch_unmeasured(painted, kelvin[i]);
      return write_png(context.folder / files[i].palette, painted);
    });
    if (!rendered.thermal_is_gray)
      writes.emplace_back([&, i] {
        return write_thermal_tiff(context.folder / files[i].thermal, kelvin[i], kelvin_per_count);
      });
  }
  ORBITFUSE_TRY(side_by_side(writes));
  if (rendered.thermal_is_gray) return {};
  return save_temperature_bounds(context.folder, rendered.span.low_k, rendered.span.high_k);
}

Result<StageOutput> render(const StageContext& context, const StageInputs& in) {
  const RenderConfig& config = in.config->render;
  ORBITFUSE_ASSIGN(Fields fields, load_fields(context));
  const Modality frame = fields.visible.empty() ? Modality::thermal : Modality::visible;
  ORBITFUSE_ASSIGN(const GivenCameras given, choose_views(context, config, frame));
  const NewViews& chosen = given.views;
  StageOutput output;
  ORBITFUSE_TRY(load_detail(context, in, chosen, fields, output));
  ORBITFUSE_ASSIGN(UnseenViews unseen, recorded_views_of(context, fields, frame));
  const bool gray = !in.session->has_temperatures();
  const Similarity3d thermal_from_visible = fields.visible_from_thermal.inverse();

  const UsageClock clock;
  std::vector<ViewFiles> files;
  std::vector<ThermalView> temperatures;
  Transforms transforms;
  for (const PosedView& view : chosen.views) {
    const TraceSpan span("new view");
    ORBITFUSE_TRY(context.progress.check("render"));
    const double done = static_cast<double>(files.size()),
                 total = static_cast<double>(chosen.views.size());
    std::optional<double> left_s;
    if (done > 0) left_s = clock.wall_s() / done * (total - done);
    context.progress.report({"render", done, total, left_s, view.name});
    const std::filesystem::path& to = context.folder;
    std::vector<std::function<Status()>> writes;
    ViewFiles f;
    f.name = view.name;
    cv::Mat depth;
    if (!fields.visible.empty()) {
      ORBITFUSE_ASSIGN(const nerf::RenderedView seen,
                       fields.visible.render(view.camera, view.cam_from_world, config.visible,
                                             context.progress));
      f.visible = "visible/" + view.name + ".png";
      f.depth = "depth/" + view.name + ".tiff";
      f.visible_opacity = "opacity/" + view.name + "_visible.tiff";
      depth = seen.depth;
      unseen.look_at(view, depth);
      writes.emplace_back([=] { return write_png(to / f.visible, bgr8_of_rgb(seen.color)); });
      writes.emplace_back([=] { return write_float_tiff(to / f.depth, depth); });
      writes.emplace_back([=] { return write_float_tiff(to / f.visible_opacity, seen.opacity); });
    }
    if (!fields.thermal.empty()) {
      const Rigid3d cam_from_thermal = frame == Modality::thermal
                                           ? view.cam_from_world
                                           : rebase(view.cam_from_world, thermal_from_visible);
      ORBITFUSE_ASSIGN(
          const nerf::RenderedView seen,
          fields.thermal.render(view.camera, cam_from_thermal, config.thermal, context.progress));
      f.thermal = "thermal/" + view.name + (gray ? ".png" : ".tiff");
      f.thermal_opacity = "opacity/" + view.name + "_thermal.tiff";
      temperatures.push_back({view, masked(seen.color, seen.opacity, config.min_opacity),
                              depth.empty() ? seen.depth : depth});
      if (gray) {
        cv::Mat levels;
        seen.color.convertTo(levels, CV_8U);
        writes.emplace_back([=] { return write_png(to / f.thermal, levels); });
      }  // temperatures are written below, when the hottest of all views says in which scale
      writes.emplace_back([=] { return write_float_tiff(to / f.thermal_opacity, seen.opacity); });
      if (f.depth.empty()) {
        f.depth = "depth/" + view.name + ".tiff";
        unseen.look_at(view, seen.depth);
        writes.emplace_back([=] { return write_float_tiff(to / f.depth, seen.depth); });
      }
    }
    ORBITFUSE_TRY(side_by_side(writes));
    TransformsFrame entry{
        f.visible.empty() ? f.thermal : f.visible, {}, view.camera, view.cam_from_world};
    if (!f.thermal.empty()) entry.thermal_file_path = f.thermal;
    if (!given.files.empty()) entry.source = given.files[files.size()];
    transforms.frames.push_back(std::move(entry));
    files.push_back(std::move(f));
  }

  output.metrics["brief"] =
      fmt::format("{}, {}, {:.2f} s a view{}", chosen.described,
                  fields.thermal.empty()   ? "visible"
                  : fields.visible.empty() ? "thermal"
                                           : "both modalities",
                  clock.wall_s() / static_cast<double>(files.size()), words_on_detail(fields));
  output.metrics["views"] = files.size();
  for (const DetailedField* shown : {&fields.visible, &fields.thermal})
    if (!shown->detail.empty())
      output.metrics[detail_key(shown->field.modality())]["share"] =
          shown->detailed / static_cast<double>(files.size());
  unseen.tell(config.cameras.empty() ? "" : "poses_" + std::string(name(frame)), output);
  RenderedViews rendered;
  rendered.thermal_is_gray = gray;
  if (!temperatures.empty()) {
    ORBITFUSE_TRY(choose_scales(context, frame, temperatures, rendered));
    ORBITFUSE_TRY(write_temperatures(context, temperatures, rendered, config.palette, files));
  }
  rendered.views = std::move(files);
  ORBITFUSE_TRY(write_transforms_json(context.folder / "transforms.json", transforms));
  ORBITFUSE_TRY(save_rendered_views(context.folder, rendered));
  return output;
}

}  // namespace

pipeline::Stage render_stage(const StageInputs& in) {
  pipeline::Stage stage;
  stage.name = "render";
  stage.version = 10;  // without photos in doubt
  stage.uses = {"poses_visible", "poses_thermal", "train_visible", "train_thermal", "register"};
  stage.options = in.config->settings().to_json("render");
  const std::string& cameras = in.config->render.cameras;
  stage.options["cameras"] =
      cameras.empty() ? "" : std::filesystem::absolute(cameras).lexically_normal().string();
  if (!cameras.empty()) stage.inputs_hash = file_hash(cameras).value_or("missing");
  stage.absent = [](const StageContext& context) -> std::optional<std::string> {
    if (context.has("train_visible") || context.has("train_thermal")) return std::nullopt;
    return "no field was trained";
  };
  stage.run = [in](const StageContext& context) { return render(context, in); };
  return stage;
}

}  // namespace orbitfuse::stages
