// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/train_extension.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/stages/artifacts.hpp"
#include "app/stages/stage_list.hpp"

namespace orbitfuse::stages {
namespace {
using nlohmann::json;

/// How long a run goes on, and what is made of its field: not what it learns, nor how.
constexpr const char* of_length[] = {"iterations",     "budget_s",       "target_psnr",
                                     "plateau_db",     "eval_count",     "checkpoint_every_s",
                                     "cloud_width_px", "cloud_tolerance"};

bool only_longer(const json& then, const json& now, const json& done) {
  if (!then.is_object() || then.size() != now.size() || !done.contains("train_wall_s"))
    return false;
  for (const auto& [key, value] : now.items()) {
    const bool length = std::count(std::begin(of_length), std::end(of_length), key) > 0;
    if (!then.contains(key) || (!length && then[key] != value)) return false;
  }
  const double budget_s = now.value("budget_s", 0.0);
  return now.value("iterations", 0) >= then.value("iterations", 0) &&
         (budget_s == 0 || budget_s >= done.value("train_wall_s", 0.0));
}

/// JSON has no NaN: there it is null, and stays NaN.
constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

Result<nerf::CurvePoint> curve_point_of(const JsonFields& fields) {
  nerf::CurvePoint p;
  p.heldout_psnr = p.train_psnr = unknown;
  ORBITFUSE_TRY(fields.get_all("cpu_s", p.cpu_s, "wall_s", p.wall_s, "step", p.step,
                               "samples_per_ray", p.samples_per_ray));
  ORBITFUSE_TRY(fields.get_present("heldout_psnr", p.heldout_psnr, "train_psnr", p.train_psnr));
  return p;
}

/// What a finished training says of itself: its curve.json and the metrics in its record.
Result<nerf::TrainReport> report_of(const std::filesystem::path& folder, const json& metrics) {
  const std::filesystem::path file = folder / "curve.json";
  ORBITFUSE_ASSIGN(const json curve, read_json(file));
  const json named = {{"curve", curve}};
  ORBITFUSE_ASSIGN(const std::vector<JsonFields> points,
                   stage_fields(named, file).children("curve"));
  nerf::TrainReport report;
  for (const JsonFields& point : points) {
    ORBITFUSE_ASSIGN(const nerf::CurvePoint read, curve_point_of(point));
    report.curve.push_back(read);
  }
  const JsonFields done(metrics, (folder / pipeline::stage_record_file).string() + ": metrics.",
                        {ErrorKind::input, "train with --force"});
  report.best_psnr = unknown;
  ORBITFUSE_TRY(done.get_present("heldout_psnr_db", report.best_psnr));
  ORBITFUSE_TRY(done.get_all("best_step", report.best_step, "train_cpu_s", report.cpu_s,
                             "train_wall_s", report.wall_s, "skipped_steps", report.skipped_steps,
                             "rays", report.rays, "samples", report.samples));
  return report;
}

}  // namespace

json curve_json(const nerf::TrainReport& report) {
  json curve = json::array();
  for (const nerf::CurvePoint& p : report.curve)
    curve.push_back({{"cpu_s", p.cpu_s},
                     {"wall_s", p.wall_s},
                     {"step", p.step},
                     {"heldout_psnr", p.heldout_psnr},
                     {"train_psnr", p.train_psnr},
                     {"samples_per_ray", p.samples_per_ray}});
  return curve;
}

json metrics_json(const nerf::TrainReport& report) {
  return {{"brief", report.brief()},
          {"iterations", report.iterations},
          {"stop", nerf::name(report.stop)},
          {"best_step", report.best_step},
          {"heldout_psnr_db", report.best_psnr},
          {"heldout", report.heldout},
          {"train_cpu_s", report.cpu_s},
          {"train_wall_s", report.wall_s},
          {"skipped_steps", report.skipped_steps},
          {"rays", report.rays},
          {"samples", report.samples},
          {"samples_per_ray", report.samples_per_ray()},
          {"image_gains", report.image_gains},
          {"gray_curves", report.gray_curves},
          {"image_offsets_k", report.image_offsets_k},
          {"shading_k", report.shading_k}};
}

Result<int> extend_training(const pipeline::StageContext& context, const json& options,
                            const std::filesystem::path& checkpoint) {
  const auto earlier = context.earlier_result();
  if (!earlier) return 0;
  const auto& [folder, then, done] = *earlier;
  if (!only_longer(then, options, done)) return 0;
  auto field = nerf::Field::load(folder / field_file);
  if (!field) return 0;  // of another version
  ORBITFUSE_ASSIGN(const nerf::TrainReport report, report_of(folder, done));
  const int steps = field->iterations();
  ORBITFUSE_TRY(nerf::save_checkpoint(*std::move(field), report, checkpoint));
  return steps;
}

}  // namespace orbitfuse::stages
