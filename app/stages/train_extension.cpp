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

/// JSON has no NaN: null.
double number(const json& j, const char* key) {
  return j.at(key).is_null() ? std::numeric_limits<double>::quiet_NaN() : j.at(key).get<double>();
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
          {"image_offsets_k", report.image_offsets_k}};
}

Result<int> extend_training(const pipeline::StageContext& context, const json& options,
                            const std::filesystem::path& checkpoint) {
  const auto earlier = context.earlier_result();
  if (!earlier) return 0;
  const auto& [folder, then, done] = *earlier;
  if (!only_longer(then, options, done)) return 0;
  auto field = nerf::Field::load(folder / field_file);
  if (!field) return 0;  // of another version
  ORBITFUSE_ASSIGN(const json curve, read_json(folder / "curve.json"));
  nerf::TrainReport report;
  try {
    for (const json& p : curve)
      report.curve.push_back({p.at("cpu_s"), p.at("wall_s"), p.at("step"),
                              number(p, "heldout_psnr"), number(p, "train_psnr"),
                              p.at("samples_per_ray")});
    report.best_psnr = number(done, "heldout_psnr_db");
    done.at("best_step").get_to(report.best_step);
    done.at("train_cpu_s").get_to(report.cpu_s);
    done.at("train_wall_s").get_to(report.wall_s);
    done.at("skipped_steps").get_to(report.skipped_steps);
    done.at("rays").get_to(report.rays);
    done.at("samples").get_to(report.samples);
  } catch (const json::exception& e) {
    return fail(ErrorKind::input, (folder / "curve.json").string(), e.what(), "train with --force");
  }
  const int steps = field->iterations();
  ORBITFUSE_TRY(nerf::save_checkpoint(*std::move(field), report, checkpoint));
  return steps;
}

}  // namespace orbitfuse::stages
