// SPDX-License-Identifier: BSD-3-Clause
// nerf_tables --data ../shared/data/orbits --cpu-seconds 60 --out docs/benchmarks
// Tables 4 to 6 of the paper that fusion/metrics/metrics.hpp names, on our scenes: the published
// recipes and ours at equal time on all cores (budgets are wall time: leave the machine alone
// meanwhile; CPU seconds are printed), the five metrics with their improvement over NeRFacto in %,
// and how much sooner ours has each published recipe's PSNR. Depth maps and guide fields count in
// the time of what uses them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <optional>

#include "bench/nerf/experiment.hpp"
#include "bench/nerf/scenes.hpp"
#include "core/system/cpu.hpp"
#include "core/system/parallel.hpp"

namespace {

using namespace orbitfuse;

struct Arguments {
  std::string data = "../shared/data/orbits", out, modality;
  std::vector<std::string> scenes = {"fox", "container", "container-sector"};
  double cpu_seconds = 60, published_factor = 1;
};

struct Row {
  bench::Run run;
  std::map<std::string, double> metrics;
  bench::TestError error;
  double cpu_s() const { return run.before_cpu_s + run.report.cpu_s; }
};

constexpr const char* columns[] = {"SSIM", "cosine", "MI", "PSNR", "hist"};

/// Half the width of the product's depth maps: a quarter of their time, which counts here.
depth::DepthOptions depth_options(const nerf::Dataset& data) {
  depth::DepthOptions options;
  options.width_px = std::min(options.width_px, data.views.front().camera.width) / 2;
  return options;
}

/// Test views at half the size where they are large: a published recipe takes 50 CPU s to render
/// 640x480.
Result<nerf::Dataset> load(const Arguments& a, const std::string& scene) {
  ORBITFUSE_ASSIGN(nerf::Dataset data, bench::load_scene(scene, a.data, {}));
  for (nerf::TrainingView& view : data.views)
    if (view.measure_only && view.camera.width > 400)
      view = nerf::resized(view, view.camera.width / 2, view.camera.height / 2);
  return data;
}

/// Trains until `cpu_seconds` are spent, `before_cpu_s` included.
Result<Row> row_of(const std::string& name, const nerf::Dataset& data, nerf::TrainOptions options,
                   double cpu_seconds, double before_cpu_s, nerf::Field& field,
                   const nerf::Field* guide = nullptr) {
  options.keep_best = false;     // nothing is chosen on the test views
  options.refine_poses = false;  // these poses are exact
  // Proposal networks take a hundred times as long to render: their curves have fewer points.
  options.eval_count = options.sampling == nerf::Sampling::proposal ? 4 : 24;
  options.iterations = 1 << 20;
  options.budget_s = (cpu_seconds - before_cpu_s) / thread_count();
  if (!(options.budget_s > 0))
    return fail(ErrorKind::usage, "--cpu-seconds",
                fmt::format("{:.0f} s are spent before training {}", before_cpu_s, name),
                "allow more");
  ORBITFUSE_ASSIGN(nerf::TrainReport report, nerf::train(data, options, {}, field, guide));
  Row row{{name, before_cpu_s, std::move(report)}, {}, {}};
  ORBITFUSE_ASSIGN(row.metrics, bench::table_metrics(field, data));
  if (data.modality == Modality::thermal) {
    ORBITFUSE_ASSIGN(row.error, bench::test_error(field, data));
  }
  return row;
}

/// CPU seconds until the views that measure were seen this well, what came before training
/// included.
std::optional<double> seconds_to(const Row& row, double psnr) {
  for (const nerf::CurvePoint& p : row.run.report.curve)
    if (p.heldout_psnr >= psnr) return row.run.before_cpu_s + p.cpu_s;
  return {};
}

/// How much sooner `ours` is as good as `published` is at its end.
std::string sooner(const Row& published, const Row& ours) {
  const nerf::CurvePoint& end = published.run.report.curve.back();  // a budget's end is measured
  const auto reached = seconds_to(ours, end.heldout_psnr);
  return reached ? fmt::format("{:.1f} x", (published.run.before_cpu_s + end.cpu_s) / *reached)
                 : "not reached";
}

void print_table(const std::string& title, const std::vector<Row>& rows) {
  fmt::print("\n## {}\n\n| field | steps | CPU s before + training |", title);
  for (const char* column : columns) fmt::print(" {} |", column);
  fmt::print(
      " MAE K | as good this much later than {} |\n|---|---|---|---|---|---|---|---|---|---|\n",
      rows.back().run.name);
  for (const Row& row : rows) {
    fmt::print("| {} | {} | {:.0f} + {:.0f} |", row.run.name, row.run.report.iterations,
               row.run.before_cpu_s, row.run.report.cpu_s);
    for (const char* column : columns) {
      const double value = row.metrics.at(column), baseline = rows.front().metrics.at(column);
      fmt::print(" {:.4g} ({:+.1f} %) |", value, 100 * (value / baseline - 1));
    }
    fmt::print(" {:.2f} | {} |\n", row.error.mae_k,
               &row == &rows.back() ? "" : sooner(row, rows.back()));
  }
  std::fflush(stdout);
}

struct Guide {
  nerf::Field field;
  double cpu_s = 0;
};

/// NeRFacto and the paper's variant for one modality.
Result<std::vector<Row>> published_rows(const Arguments& a, const nerf::Dataset& data) {
  std::vector<Row> rows;
  for (const char* name :
       {"nerfacto", data.modality == Modality::visible ? "nerf-rgb" : "nerf-ir"}) {
    ORBITFUSE_ASSIGN(const nerf::TrainOptions options, nerf::preset(name));
    nerf::Field field;
    ORBITFUSE_ASSIGN(Row row,
                     row_of(name, data, options, a.cpu_seconds * a.published_factor, 0, field));
    rows.push_back(std::move(row));
  }
  return rows;
}

Status finish(const Arguments& a, const std::string& scene, const std::vector<Row>& rows) {
  print_table(scene, rows);
  if (a.out.empty()) return {};
  std::vector<bench::Run> runs;
  for (const Row& one : rows) runs.push_back(one.run);
  std::string stem = "nerf_" + scene;
  std::replace(stem.begin(), stem.end(), '/', '_');
  return bench::write_curves(a.out, stem, runs);
}

Status visible_table(const Arguments& a, const std::string& scene) {
  ORBITFUSE_ASSIGN(nerf::Dataset data, load(a, scene));
  ORBITFUSE_ASSIGN(std::vector<Row> rows, published_rows(a, data));
  ORBITFUSE_ASSIGN(const nerf::TrainOptions options,
                   nerf::preset(nerf::default_preset(data.modality)));
  double before = 0;
  if (scene != "fox") {
    ORBITFUSE_ASSIGN(before, bench::add_depth(data, depth_options(data)));
  }
  nerf::Field field;
  ORBITFUSE_ASSIGN(Row row, row_of(options.preset, data, options, a.cpu_seconds, before, field));
  rows.push_back(std::move(row));
  return finish(a, scene, rows);
}

/// A visible field of the same views' sector that takes half the time.
Result<Guide> guide_of(const Arguments& a, const std::string& visible_scene) {
  ORBITFUSE_ASSIGN(nerf::Dataset data, load(a, visible_scene));
  ORBITFUSE_ASSIGN(const nerf::TrainOptions options,
                   nerf::preset(nerf::default_preset(data.modality)));
  ORBITFUSE_ASSIGN(const double before, bench::add_depth(data, depth_options(data)));
  Guide guide;
  ORBITFUSE_ASSIGN(const Row row,
                   row_of("guide", data, options, a.cpu_seconds / 2, before, guide.field));
  guide.cpu_s = row.cpu_s();
  return guide;
}

Status thermal_table(const Arguments& a, const std::string& scene,
                     const std::string& visible_scene) {
  ORBITFUSE_ASSIGN(const nerf::Dataset data, load(a, scene));
  ORBITFUSE_ASSIGN(std::vector<Row> rows, published_rows(a, data));
  ORBITFUSE_ASSIGN(nerf::TrainOptions options, nerf::preset(nerf::default_preset(data.modality)));
  nerf::Field alone, shared;
  nerf::Dataset with_depth = data;
  ORBITFUSE_ASSIGN(const double before,
                   bench::add_depth(with_depth, {.width_px = 260}));  // the program's default
  ORBITFUSE_ASSIGN(Row own, row_of(options.preset + " alone", with_depth, options, a.cpu_seconds,
                                   before, alone));
  rows.push_back(std::move(own));
  ORBITFUSE_ASSIGN(const Guide guide, guide_of(a, visible_scene));
  options.shared_geometry = true;
  ORBITFUSE_ASSIGN(Row guided, row_of(options.preset, data, options, a.cpu_seconds, guide.cpu_s,
                                      shared, &guide.field));
  rows.push_back(std::move(guided));
  return finish(a, scene, rows);
}

Status run(const Arguments& a) {
  fmt::print("{}, {} threads, {}; {:.0f} CPU s a field, {:g} times that for the published ones\n",
             cpu_description(), thread_count(), name(best_isa()), a.cpu_seconds,
             a.published_factor);
  for (const std::string& scene : a.scenes) {
    if (a.modality != "thermal") ORBITFUSE_TRY(visible_table(a, scene));
    if (scene == "fox" || a.modality == "visible") continue;
    const bool sector = scene.ends_with("-sector");
    const std::string base = sector ? scene.substr(0, scene.size() - 7) : scene;
    ORBITFUSE_TRY(thermal_table(a, base + (sector ? "-thermal-sector" : "-thermal"), scene));
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Arguments a;
  CLI::App app("The published recipes and ours at equal CPU time");
  app.add_option("--data", a.data);
  app.add_option("--scenes", a.scenes, "fox, an orbit in --data or a path to one, ORBIT-sector");
  app.add_option("--cpu-seconds", a.cpu_seconds, "per field, depth and guide included")
      ->check(CLI::PositiveNumber);
  app.add_option("--published-factor", a.published_factor,
                 "so many times that for the published recipes")
      ->check(CLI::PositiveNumber);
  app.add_option("--modality", a.modality, "only this one's tables")
      ->check(CLI::IsMember({"visible", "thermal"}));
  app.add_option("--out", a.out, "folder for the curves");
  CLI11_PARSE(app, argc, argv);
  if (const auto status = run(a); !status) {
    fmt::print(stderr, "{}\n", status.error().message());
    return 1;
  }
  return 0;
}
