// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/report_content.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/pipeline/runner.hpp"
#include "app/stages/artifacts.hpp"
#include "app/stages/metric_scale.hpp"
#include "app/stages/rendered_views.hpp"
#include "app/stages/saved_measurements.hpp"
#include "core/first_names.hpp"
#include "core/image/image_io.hpp"
#include "core/nested_text.hpp"
#include "core/numeric/percent.hpp"
#include "core/system/cpu.hpp"
#include "core/system/file_io.hpp"
#include "core/system/parallel.hpp"
#include "core/system/utc_now.hpp"
#include "core/temperature.hpp"
#include "recon/assembly/training_data.hpp"

namespace orbitfuse::stages {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using pipeline::StageContext;
using pipeline::StageState;
using pipeline::StageStatus;

/// More views would make the page too heavy to mail; the folders hold them all.
constexpr std::size_t max_report_views = 16;

Result<report::View> load_view(const StageContext& context, const ViewFiles& files,
                               Samples samples) {
  const fs::path folder = context.of("render");
  report::View view;
  view.name = files.name;
  if (!files.visible.empty()) {
    ORBITFUSE_ASSIGN(view.visible, read_visible(folder / files.visible));
  }
  if (!files.palette.empty()) {
    ORBITFUSE_ASSIGN(view.thermal, read_visible(folder / files.palette));
    ORBITFUSE_ASSIGN(view.temperature_k, field_image(folder / files.thermal, samples));
  }
  return view;
}

Status add_fused(const StageContext& context, const std::vector<std::string>& methods,
                 report::View& view) {
  for (const std::string& method : methods) {
    ORBITFUSE_ASSIGN(cv::Mat image, read_image(context.of("fuse") / method / (view.name + ".png")));
    view.fused.push_back({method, std::move(image)});
  }
  return {};
}

/// How many were rendered: the page may show fewer.
Result<std::size_t> add_views(const StageContext& context, const RunConfig& config,
                              report::Model& model) {
  if (!context.has("render")) return 0;
  ORBITFUSE_ASSIGN(const RenderedViews rendered, load_rendered_views(context.of("render")));
  std::vector<std::string> methods;
  if (context.has("fuse")) {
    ORBITFUSE_ASSIGN(FusedImages fused, load_fused_images(context.of("fuse")));
    methods = std::move(fused.methods);
  }
  for (const ViewFiles& files : rendered.views) {
    if (model.views.size() == max_report_views) {
      model.warnings.push_back(fmt::format("The report shows {} of {} views; render/ holds all.",
                                           max_report_views, rendered.views.size()));
      break;
    }
    ORBITFUSE_ASSIGN(report::View view, load_view(context, files, rendered.samples()));
    ORBITFUSE_TRY(add_fused(context, methods, view));
    model.views.push_back(std::move(view));
  }
  model.span = rendered.span;
  if (std::count(methods.begin(), methods.end(), "heat") > 0)
    model.heat = fusion::HeatLegend{rendered.heat, rendered.heat_unit(), config.fuse.options.heat};
  model.has_temperature =
      !rendered.thermal_is_gray && !model.views.empty() && !model.views[0].thermal.empty();
  if (!model.views.empty() && !model.views[0].thermal.empty()) {
    ORBITFUSE_ASSIGN(model.palette_bgr, palette(config.render.palette));
  }
  return rendered.views.size();
}

std::string advice(const report::PosesSummary& poses) {
  if (poses.posed == poses.total) return {};
  return poses.modality == "Visible"
             ? "Views without a pose are left out. Record them again with more overlap, sharp and "
               "without reflections, or add frames between the stations."
             : "Views without a pose are left out. Frames recorded between stations and a warmer "
               "object give thermal views more to hold on to.";
}

std::string said_of_doubts(const json& metrics) {
  const json doubtful = metrics.value("doubtful", json::array());
  if (doubtful.empty()) return "No view is doubtful.";
  std::vector<std::string> names;
  for (const json& view : doubtful) names.push_back(view.value("view", "?"));
  return fmt::format("{} {} doubtful: {}.", names.size(), names.size() == 1 ? "is" : "are",
                     first_names(names, 5));
}

/// "Posed by COLMAP, orbit pairs. Focal length 721.6 px, found to 0.1 %. ..."
std::string said_of_poses(const json& metrics, const std::string& stage) {
  std::string said = fmt::format("Posed by: {}.", metrics.value("attempt", "?"));
  if (const double px = metrics.value("reprojection_rms_px", 0.0); px > 0)
    said += fmt::format(" {} points, seen to {:.2f} px.", metrics.value("points", 0), px);
  if (const json focal = metrics.value("focal_px", json()); focal.is_number()) {
    said += fmt::format(" Focal length {:.1f} px", focal.get<double>());
    const json sigma = metrics.value("gates", json::object()).value("focal_sigma_percent", json());
    said += sigma.is_number() ? fmt::format(", found to {:.2g} %.", sigma.get<double>()) : ".";
  }
  return said + " " + said_of_doubts(metrics) +
         fmt::format(" Files: {0}/model (COLMAP), {0}/transforms.json (nerfstudio).", stage);
}

/// A good model that a later attempt bettered did not fail.
std::string outcome_of(const json& attempt) {
  if (attempt.value("held", false)) return "held";
  if (attempt.value("bettered", false)) return "good, and bettered by a later attempt";
  return "did not hold";
}

void add_poses(const StageContext& context, const SessionInput& input, report::Model& model) {
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const bool visible = modality == Modality::visible;
    report::PosesSummary poses;
    poses.modality = visible ? "Visible" : "Thermal";
    poses.total = input.count(modality);
    if (poses.total == 0) continue;
    const std::string stage = "poses_" + std::string(name(modality));
    std::size_t doubtful = 0;
    if (const json* m = context.metrics_of(stage)) {
      poses.found = said_of_poses(*m, stage);
      poses.posed = m->value("posed", 0);
      poses.total = m->value("total", poses.total);
      doubtful = m->value("doubtful", json::array()).size();
      for (const json& attempt : m->value("ladder", json::array()))
        poses.ladder.push_back(
            {attempt.value("attempt", ""), outcome_of(attempt), attempt.value("why", "")});
    }
    poses.advice = advice(poses);
    model.headline.emplace_back(fmt::format("{} views posed", name(modality)),
                                fmt::format("{} of {}", poses.posed, poses.total));
    if (doubtful > 0)
      model.headline.emplace_back(fmt::format("of these {} views doubtful", name(modality)),
                                  fmt::format("{}", doubtful));
    model.poses.push_back(std::move(poses));
  }
}

void add_registration(const StageContext& context, report::Model& model) {
  const json* m = context.metrics_of("register");
  if (!m) return;
  model.registration_note = m->value("note", "");
  for (const json& fact : m->value("facts", json::array()))
    model.registration.emplace_back(fact.at(0), fact.at(1));
}

void add_fields(const StageContext& context, report::Model& model) {
  report::Table table{"Radiance fields",
                      {{"Field", ""},
                       {"Held-out PSNR (dB)",
                        "10 log10(peak² / MSE) on views that did not train; "
                        "thermal over the session's span"},
                       {"Steps", "Of the parameters kept"},
                       {"Samples a ray", "Mean over training"},
                       {"Cloud points", "Exported to cloud.ply"}},
                      {}};
  for (const char* stage : {"train_visible", "train_thermal"}) {
    const json* m = context.metrics_of(stage);
    if (!m) continue;
    const json psnr = m->value("heldout_psnr_db", json());
    table.rows.push_back(
        {std::string(stage).substr(6),
         psnr.is_number() ? fmt::format("{:.2f}", psnr.get<double>()) : "all views trained",
         fmt::format("{}", m->value("best_step", 0)),
         fmt::format("{:.1f}", m->value("samples_per_ray", 0.0)),
         fmt::format("{}", m->value("cloud_points", 0))});
  }
  if (!table.rows.empty()) model.tables.push_back(std::move(table));
}

report::Table table_of(const json& t) {
  report::Table table;
  table.title = t.value("title", "");
  for (const json& c : t.at("columns")) table.columns.push_back({c.at(0), c.at(1)});
  table.rows = t.at("rows").get<std::vector<std::vector<std::string>>>();
  return table;
}

void add_metric_tables(const StageContext& context, report::Model& model) {
  const json* m = context.metrics_of("metrics");
  if (!m) return;
  for (const json& table : m->value("tables", json::array()))
    model.tables.push_back(table_of(table));
}

/// What others measured in the run since; of another run, or damaged, it is named and left out.
void add_measurements(const StageContext& context, const SessionInput& input,
                      report::Model& model) {
  auto table = measurement_table(context.out, input.session);
  if (table)
    model.measurements = *std::move(table);
  else
    model.warnings.push_back("saved measurements are not shown: " + table.error().message());
}

/// Told since the run, or not at all.
void add_scale(const StageContext& context, report::Model& model) {
  const auto scale = scale_of_run(context.out);
  if (!scale)
    model.warnings.push_back(scale_words(scale));
  else if (*scale)
    model.headline.emplace_back("a unit of the run, ± " + uncertainty_words(**scale),
                                fmt::format("{:.4f} m", (*scale)->metres_per_unit));
  else
    model.headline.emplace_back("in metres is known", "no scale");
}

/// Of a run with a budget: what was planned, and what came of it.
void add_plan(const StageContext& context, report::Model& model) {
  const auto text = read_file(context.out / "plan.json");
  if (!text) return;
  const json plan = parse_json(*text);
  try {
    model.tables.push_back(table_of(plan.at("table")));
  } catch (const json::exception&) {
    model.warnings.push_back("plan.json is damaged: what was planned is not shown");
  }
}

/// What the data did not allow, once per reason.
void add_notices(const StageContext& context, const SessionInput& input, report::Model& model) {
  for (const Modality modality : {Modality::visible, Modality::thermal})
    if (!input.has(modality))
      model.notices.push_back(
          fmt::format("This session has no {} frames: everything below is of the {} ones alone.",
                      name(modality),
                      name(modality == Modality::visible ? Modality::thermal : Modality::visible)));
  if (input.has(Modality::thermal) && !input.has_temperatures())
    model.notices.push_back("The thermal frames hold gray levels, not temperatures.");
  for (const StageStatus& s : *context.earlier)
    if (s.state == StageState::blocked)
      model.notices.push_back(fmt::format("{} was not run: {}.", s.stage, s.why));
}

}  // namespace

Result<report::Model> report_content(const StageContext& context, const StageInputs& in) {
  const SessionInput& input = *in.session;
  report::Model model;
  const std::string folder = input.session.folder.lexically_normal().filename().string();
  model.title = folder.empty() ? input.session.id : folder;
  model.subtitle =
      fmt::format("Session {}, recorded {}. Computed on {}, {} threads.", input.session.id,
                  input.session.created, cpu_description(), thread_count());
  ORBITFUSE_ASSIGN(const std::size_t rendered_views, add_views(context, *in.config, model));
  add_poses(context, input, model);
  add_registration(context, model);
  add_fields(context, model);
  add_metric_tables(context, model);
  add_plan(context, model);
  add_measurements(context, input, model);
  add_scale(context, model);
  add_notices(context, input, model);
  model.stages = *context.earlier;
  double wall_s = 0;
  for (const StageStatus& s : model.stages) wall_s += s.wall_s;
  model.headline.emplace_back("new views", fmt::format("{}", rendered_views));
  if (model.has_temperature)
    model.headline.emplace_back(
        "temperatures shown",
        fmt::format("{:.0f} to {:.0f} °C", celsius_from_kelvin(model.span.low_k),
                    celsius_from_kelvin(model.span.high_k)));
  if (const json* fused = context.metrics_of("fuse"); fused && fused->contains("measured_share"))
    model.headline.emplace_back(input.has_temperatures() ? "of the new views has a temperature"
                                                         : "of the new views is seen by infrared",
                                percent(fused->at("measured_share").get<double>()));
  model.headline.emplace_back("run time", fmt::format("{:.0f} s", wall_s));
  model.warnings.insert(model.warnings.end(), input.session.warnings.begin(),
                        input.session.warnings.end());
  for (const StageStatus& s : model.stages)
    for (const std::string& warning : s.output.warnings)
      model.warnings.push_back(s.stage + ": " + warning);
  model.software = pipeline::software_version();
  model.made = utc_now_text();
  model.configuration = in.config->settings().to_toml();
  return model;
}

}  // namespace orbitfuse::stages
