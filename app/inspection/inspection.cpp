// SPDX-License-Identifier: BSD-3-Clause
#include "app/inspection/inspection.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>

#include "app/inspection/facts.hpp"
#include "app/inspection/plan.hpp"
#include "app/pipeline/runner.hpp"
#include "app/stages/measurement_scene.hpp"
#include "app/view/finished_run.hpp"

namespace orbitfuse::inspection {
namespace fs = std::filesystem;
namespace {

Status add_findings(const std::vector<InspectionFinding>& findings, const view::FinishedRun& run,
                    const measurement::ThermalScene& scene, const Progress& progress,
                    InspectionModel& model) {
  for (const InspectionFinding& finding : findings) {
    ORBITFUSE_TRY(progress.check("inspection"));
    progress.report({"inspection", static_cast<double>(model.findings.size()),
                     static_cast<double>(findings.size())});
    ORBITFUSE_ASSIGN(FindingPictures pictures, pictures_of(finding, run, scene, progress));
    model.findings.push_back({finding, std::move(pictures)});
  }
  return {};
}

std::string plan_of(const view::FinishedRun& run, const std::vector<ShownFinding>& findings) {
  std::vector<PlanMark> marks;
  for (const ShownFinding& shown : findings)
    if (const auto position = shown.finding.position())
      marks.push_back({shown.finding.number, *position, shown.pictures.view});
  return plan_svg(run, marks);
}

}  // namespace

Result<InspectionModel> inspection_of(const fs::path& out, const Session& session,
                                      const InspectionDetails& details,
                                      const stages::RunConfig& config, const Progress& progress) {
  ORBITFUSE_ASSIGN(const measurement::ThermalScene scene,
                   stages::load_measurement_scene(out, session));
  ORBITFUSE_ASSIGN(
      measurement::Measurements saved,
      measurement::load_measurements(out / measurement::measurements_file, scene.identity()));
  bring_to_scale(saved, scene.metres_per_unit(), scene.scale_relative_sigma());
  ORBITFUSE_ASSIGN(const std::vector<InspectionFinding> findings, findings_of(saved, details));
  ORBITFUSE_ASSIGN(const view::FinishedRun run, view::load_finished_run(out, config, progress));
  InspectionModel model;
  model.title = details.text("inspection.title").empty() ? "Thermographic inspection"
                                                         : details.text("inspection.title");
  model.cover = cover_facts(details);
  model.cameras = camera_facts(session, details);
  model.conditions = condition_facts(details);
  model.radiometry = radiometry_facts(session, details);
  ORBITFUSE_TRY(add_findings(findings, run, scene, progress, model));
  model.plan_svg = plan_of(run, model.findings);
  model.classes = details.classes;
  model.limits = limits_of(session, run, details, findings);
  for (const std::string& note : saved.notes) model.limits.push_back(note + ".");
  model.span = run.span;
  ORBITFUSE_ASSIGN(model.palette_bgr, palette(run.config.render.palette));
  if (run.has(Modality::visible) && run.heat.is_valid())
    model.heat =
        fusion::HeatLegend{run.heat, fusion::HeatUnit::kelvin, run.config.fuse.options.heat};
  const fs::path folder = fs::absolute(out).lexically_normal();
  model.run = (folder.has_filename() ? folder : folder.parent_path()).filename().string();
  model.software = pipeline::software_version();
  model.created = fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr)));
  return model;
}

}  // namespace orbitfuse::inspection
