// SPDX-License-Identifier: BSD-3-Clause
// nerf_tables --data ../shared/data/orbits --cpu-seconds 80 --out docs/benchmarks
// The seed paper's Tables 4 to 6 on our scenes: the published recipes and ours at equal wall time
// on all cores (CPU seconds are printed; leave the machine alone meanwhile),
// the five metrics, the improvement over NeRFacto in %, and each run's error against time.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "bench/nerf/experiment.hpp"
#include "bench/nerf/scenes.hpp"
#include "core/cpu.hpp"
#include "core/parallel.hpp"

namespace {

using namespace orbitfuse;

struct Arguments {
  std::string data = "../shared/data/orbits", out, only;
  double cpu_seconds = 80;
};

struct Row {
  bench::Run run;
  std::map<std::string, double> metrics;
  bench::TestError error;
};

constexpr const char* columns[] = {"SSIM", "cosine", "MI", "PSNR", "hist"};

Result<Row> row_of(const std::string& name, const nerf::Dataset& data, nerf::TrainOptions options,
                   double cpu_seconds, double before_cpu_s, nerf::Field& field, const nerf::Field* guide = nullptr) {
  options.keep_best = false;
  options.eval_count = 6;
  options.budget_s = std::max(1.0, cpu_seconds - before_cpu_s) / thread_count();
  ORBITFUSE_ASSIGN(nerf::TrainReport report, nerf::train(data, options, {}, field, guide));
  Row row{{name, before_cpu_s, std::move(report)}, {}, {}};
  ORBITFUSE_ASSIGN(row.metrics, bench::table_metrics(field, data));
  ORBITFUSE_ASSIGN(row.error, bench::test_error(field, data));
  return row;
}

void print_table(const std::string& title, const std::vector<Row>& rows) {
  fmt::print("\n## {}\n\n| field | steps | CPU s |", title);
  for (const char* column : columns) fmt::print(" {} |", column);
  fmt::print(" MAE K | PSNR against NeRFacto |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Row& row : rows) {
    fmt::print("| {} | {} | {:.0f} + {:.0f} |", row.run.name, row.run.report.iterations, row.run.before_cpu_s,
               row.run.report.cpu_s);
    for (const char* column : columns) fmt::print(" {:.4f} |", row.metrics.at(column));
    fmt::print(" {:.2f} | {:+.1f} % |\n", row.error.mae_k,
               100 * (row.metrics.at("PSNR") / rows.front().metrics.at("PSNR") - 1));
  }
  std::fflush(stdout);
}

/// NeRFacto, the paper's variant and our preset on one scene.
Status table(const Arguments& a, const std::string& scene, const std::string& title, const nerf::Field* guide,
             double guide_cpu_s, nerf::Field& ours) {
  ORBITFUSE_ASSIGN(nerf::Dataset data, bench::load_scene(scene, a.data, {}));
  const bool visible = data.modality == Modality::visible;
  std::vector<Row> rows;
  for (const char* name : {"nerfacto", visible ? "nerf-rgb" : "nerf-ir"}) {
    ORBITFUSE_ASSIGN(const nerf::TrainOptions options, nerf::preset(name));
    nerf::Field field;
    ORBITFUSE_ASSIGN(Row row, row_of(name, data, options, a.cpu_seconds, 0, field));
    rows.push_back(std::move(row));
  }
  ORBITFUSE_ASSIGN(nerf::TrainOptions options, nerf::preset(nerf::default_preset(data.modality)));
  double before = 0;
  if (visible && scene != "fox") {
    ORBITFUSE_ASSIGN(before, bench::add_depth(data, {}));
  }
  ORBITFUSE_ASSIGN(Row row, row_of(options.preset, data, options, a.cpu_seconds, before, ours));
  rows.push_back(std::move(row));
  if (guide != nullptr) {
    options.shared_geometry = true;
    nerf::Field shared;
    ORBITFUSE_ASSIGN(Row guided, row_of(options.preset + ", shared geometry", data, options,
                                        a.cpu_seconds + guide_cpu_s, guide_cpu_s, shared, guide));  // the guide's own training comes on top, and is printed
    rows.push_back(std::move(guided));
  }
  print_table(title, rows);
  if (a.out.empty()) return {};
  std::vector<bench::Run> runs;
  for (const Row& one : rows) runs.push_back(one.run);
  return bench::write_curves(a.out, "nerf_" + scene, runs);
}

Status run(const Arguments& a) {
  fmt::print("{}, {} threads, {}; {:.0f} CPU s a field\n", cpu_description(), thread_count(), name(best_isa()),
             a.cpu_seconds);
  nerf::Field visible, unused;
  const auto wanted = [&](const char* scene) { return a.only.empty() || a.only == scene; };
  if (wanted("fox")) ORBITFUSE_TRY(table(a, "fox", "Visible, fox (unbounded)", nullptr, 0, unused));
  ORBITFUSE_TRY(table(a, "container", "Visible, container (Table 4)", nullptr, 0, visible));
  if (wanted("container-thermal"))
    ORBITFUSE_TRY(table(a, "container-thermal", "Thermal, container (Table 5)", &visible, a.cpu_seconds, unused));
  if (wanted("container-thermal-sector"))
    ORBITFUSE_TRY(table(a, "container-thermal-sector", "Thermal, 120 degree sector (Table 6)", &visible,
                        a.cpu_seconds, unused));
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Arguments a;
  CLI::App app("The published recipes and ours at equal CPU time");
  app.add_option("--data", a.data);
  app.add_option("--cpu-seconds", a.cpu_seconds, "per field, depth included");
  app.add_option("--only", a.only, "one scene, and container, which guides");
  app.add_option("--out", a.out, "folder for the curves");
  CLI11_PARSE(app, argc, argv);
  if (const auto status = run(a); !status) {
    fmt::print(stderr, "{}\n", status.error().message());
    return 1;
  }
  return 0;
}
