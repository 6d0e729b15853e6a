// SPDX-License-Identifier: BSD-3-Clause
// Success, error and CPU time of registration on synthetic pairs.
//   bench_registration [--trials 20] [--first-seed 0] [--cloud car] [--level "gap, hard"]
//     [--initialiser both|features|grid|none] [--oracle] [--no-warp] [--out FILE.json]
//     [--verbose]
// "both" also refines from near starts, "none" does that only; --oracle adds the errors of the best
// similarities that the true correspondences allow; --no-warp leaves the estimate of a smooth warp
// out.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "bench/registration/oracle.hpp"
#include "core/numeric/median.hpp"
#include "core/system/file_io.hpp"
#include "core/system/parallel.hpp"
#include "recon/registration/register.hpp"
#include "tests/support/cloud_scenes.hpp"

using namespace orbitfuse;

namespace {

struct Arguments {
  int trials = 20, first_seed = 0;
  std::string cloud, level, initialiser = "both", out;
  bool verbose = false, oracle = false, no_warp = false;
};

double median_or_nan(const std::vector<double>& values) {
  return values.empty() ? NAN : median(values);
}

double scale_error_percent(const Similarity3d& a, const Similarity3d& b) {
  return 100 * std::abs(a.scale / b.scale - 1);
}

/// Errors of estimates against the truth, and what they cost.
struct Errors {
  std::vector<double> rotation_deg, scale_percent, rmse_percent, cpu_ms;

  void add(const scenes::CloudPair& pair, const Similarity3d& estimate, double cpu_s = 0) {
    rotation_deg.push_back(rotation_angle_deg(estimate.rotation, pair.target_from_source.rotation));
    scale_percent.push_back(scale_error_percent(estimate, pair.target_from_source));
    rmse_percent.push_back(scenes::surface_rmse_percent(pair, estimate));
    cpu_ms.push_back(1000 * cpu_s);
  }
  std::string text() const {
    return fmt::format("{:.2f} / {:.2f} / {:.2f}", median_or_nan(rotation_deg),
                       median_or_nan(scale_percent), median_or_nan(rmse_percent));
  }
  nlohmann::json json() const {
    return {{"count", rotation_deg.size()},
            {"rotation_deg_median", median_or_nan(rotation_deg)},
            {"scale_percent_median", median_or_nan(scale_percent)},
            {"rmse_percent_of_diameter_median", median_or_nan(rmse_percent)},
            {"cpu_ms_median", median_or_nan(cpu_ms)}};
  }
};

struct Tally {
  int trials = 0, good = 0, flagged_wrong = 0, flagged_good = 0, errors = 0;
  std::vector<double> cpu_ms;
  Errors right;    ///< of the successes
  Errors refined;  ///< refinement alone
  std::map<scenes::Oracle, Errors> oracles;
  std::map<std::string, int> good_of_cloud;
};

/// From 3 degrees and 3 % off, turned about the object's middle.
void run_refinement(const scenes::CloudPair& pair, const Arguments& arguments, std::uint32_t seed,
                    Tally& tally) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const Similarity3d& truth = pair.target_from_source;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const auto& p : pair.check) center += truth * p / static_cast<double>(pair.check.size());
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(
      3 * 3.14159265358979 / 180,
      Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized()));
  const double grow = random() % 2 ? 1.03 : 1 / 1.03;
  Similarity3d kick{grow, turn, center - grow * (turn * center)};
  RegistrationOptions options;
  options.estimate_warp = !arguments.no_warp;
  const auto refined = refine_registration(pair.source, pair.target, kick * truth, options);
  if (refined) tally.refined.add(pair, refined->target_from_source, refined->cpu_s);
}

void explain(const scenes::CloudPair& pair, const RegistrationOptions& options,
             const RegistrationReport& report, const std::string& label, std::uint32_t seed) {
  const Similarity3d& truth = pair.target_from_source;
  bool among = false;
  for (const auto& a : report.alternatives) {
    among |= rotation_angle_deg(a.target_from_source.rotation, truth.rotation) < 5 &&
             scale_error_percent(a.target_from_source, truth) < 5;
  }
  const auto from_truth = refine_registration(pair.source, pair.target, truth, options);
  fmt::print(
      "  {} seed {}: {:.1f} deg, {:.1f} %, {:.0f} ms; truth among alternatives: {}, truth's "
      "evidence {:.3f}; runner-up {:.3f}; {}\n",
      label, seed, rotation_angle_deg(report.target_from_source.rotation, truth.rotation),
      scale_error_percent(report.target_from_source, truth), 1000 * report.cpu_s, among,
      from_truth ? from_truth->evidence : -1,
      report.alternatives.empty() ? 0 : report.alternatives[0].evidence, report.brief());
  std::fflush(stdout);
}

void run_trial(const scenes::CloudPair& pair, const Arguments& arguments, const std::string& level,
               const std::string& cloud, std::uint32_t seed, Tally& tally) {
  ++tally.trials;
  RegistrationOptions options;
  options.seed = seed + 1;
  options.estimate_warp = !arguments.no_warp;
  options.use_features = arguments.initialiser != "grid";
  options.use_grid = arguments.initialiser != "features";
  const auto report = register_clouds(pair.source, pair.target, options, {});
  if (!report) {
    ++tally.errors;
    if (arguments.verbose)
      fmt::print("  {} {} seed {}: {}\n", level, cloud, seed, report.error().message());
    return;
  }
  const Similarity3d &truth = pair.target_from_source, &found = report->target_from_source;
  const bool good = rotation_angle_deg(found.rotation, truth.rotation) < 5 &&
                    scale_error_percent(found, truth) < 5;
  tally.good += good;
  tally.good_of_cloud[cloud] += good;
  tally.flagged_wrong += !good && report->ambiguous;
  tally.flagged_good += good && report->ambiguous;
  tally.cpu_ms.push_back(1000 * report->cpu_s);
  if (good) tally.right.add(pair, found, report->cpu_s);
  if (arguments.verbose && (!good || arguments.trials < 4))
    explain(pair, options, *report, level + " " + cloud, seed);
}

void run_oracles(const scenes::CloudPair& pair, Tally& tally) {
  for (const auto kind :
       {scenes::Oracle::all_points, scenes::Oracle::common, scenes::Oracle::robust_common}) {
    if (const auto best = scenes::oracle_similarity(pair, kind))
      tally.oracles[kind].add(pair, *best);
  }
}

void print_row(const scenes::Level& level, const Tally& t) {
  std::string clouds;
  for (const auto& [name, good] : t.good_of_cloud)
    clouds += fmt::format("{}{} {}", clouds.empty() ? "" : ", ", name, good);
  fmt::print(
      "| {} | {}/{} = {:.0f} % ({:.0f}) | {} | {}/{} | {}/{} | {} | {:.0f} ({:.0f}) | {}, {:.0f} |",
      level.name, t.good, t.trials, 100.0 * t.good / std::max(1, t.trials), 100 * level.success_bar,
      clouds, t.flagged_wrong + t.errors, t.trials - t.good, t.flagged_good, t.good, t.right.text(),
      median_or_nan(t.cpu_ms),
      t.cpu_ms.empty() ? 0 : *std::max_element(t.cpu_ms.begin(), t.cpu_ms.end()), t.refined.text(),
      median_or_nan(t.refined.cpu_ms));
  for (const auto& [kind, errors] : t.oracles) fmt::print(" {} |", errors.text());
  fmt::print("\n");
  std::fflush(stdout);
}

nlohmann::json json_row(const scenes::Level& level, const Tally& t) {
  nlohmann::json row = {{"level", level.name},
                        {"trials", t.trials},
                        {"right", t.good},
                        {"bar", level.success_bar},
                        {"wrong_flagged", t.flagged_wrong},
                        {"right_flagged", t.flagged_good},
                        {"errors", t.errors},
                        {"cpu_ms_median", median_or_nan(t.cpu_ms)},
                        {"of_the_right", t.right.json()},
                        {"refinement", t.refined.json()}};
  const char* names[] = {"oracle_all_points", "oracle_common", "oracle_robust_common"};
  for (const auto& [kind, errors] : t.oracles) row[names[static_cast<int>(kind)]] = errors.json();
  return row;
}

Arguments parse(int argc, char** argv) {
  Arguments a;
  const std::map<std::string, std::string*> texts = {{"--cloud", &a.cloud},
                                                     {"--level", &a.level},
                                                     {"--initialiser", &a.initialiser},
                                                     {"--out", &a.out}};
  const std::map<std::string, int*> numbers = {{"--trials", &a.trials},
                                               {"--first-seed", &a.first_seed}};
  const std::map<std::string, bool*> switches = {
      {"--verbose", &a.verbose}, {"--oracle", &a.oracle}, {"--no-warp", &a.no_warp}};
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const bool has_value = i + 1 < argc;
    if (const auto s = switches.find(name); s != switches.end()) {
      *s->second = true;
    } else if (const auto t = texts.find(name); t != texts.end() && has_value) {
      *t->second = argv[++i];
    } else if (const auto n = numbers.find(name); n != numbers.end() && has_value) {
      *n->second = std::atoi(argv[++i]);
    } else {
      fmt::print(stderr, "unknown argument {}, or its value is missing\n", name);
      std::exit(2);
    }
  }
  return a;
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = parse(argc, argv);
  set_thread_count(1);
  std::vector<std::pair<std::string, scenes::Surface>> surfaces;
  for (const char* name : {"bunny", "indoor", "car"}) {
    if (!arguments.cloud.empty() && arguments.cloud != name) continue;
    auto s = scenes::surface(name);
    fmt::print("{}: {}\n", name,
               s ? fmt::format("largest radius {:.3f} of the diameter", s->radius() / s->diameter())
                 : "skipped, not in the shared data");
    if (s) surfaces.emplace_back(name, std::move(*s));
  }
  fmt::print(
      "| level | success (bar) | per cloud | wrong: flagged | right: flagged | rot deg / scale % / "
      "RMSE % | CPU ms median (max) | refinement: rot / scale / RMSE, ms |{}\n"
      "|---|---|---|---|---|---|---|---|{}\n",
      arguments.oracle ? " oracle: all points | common | common, robust |" : "",
      arguments.oracle ? "---|---|---|" : "");
  std::vector<double> all_ms;
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t l = 0; l < scenes::levels().size(); ++l) {
    const scenes::Level& level = scenes::levels()[l];
    if (!arguments.level.empty() && arguments.level != level.name) continue;
    Tally total;
    for (const auto& [name, surface] : surfaces) {
      for (int trial = 0; trial < arguments.trials; ++trial) {
        const auto seed = static_cast<std::uint32_t>(arguments.first_seed + trial) * 1000u +
                          static_cast<std::uint32_t>(l);
        const scenes::CloudPair pair = scenes::make_pair(surface, level, seed);
        if (arguments.initialiser != "none")
          run_trial(pair, arguments, level.name, name, seed, total);
        if (arguments.initialiser == "both" || arguments.initialiser == "none")
          run_refinement(pair, arguments, seed, total);
        if (arguments.oracle) run_oracles(pair, total);
      }
    }
    all_ms.insert(all_ms.end(), total.cpu_ms.begin(), total.cpu_ms.end());
    print_row(level, total);
    rows.push_back(json_row(level, total));
  }
  fmt::print("median over all pairs: {:.0f} CPU ms\n", median_or_nan(all_ms));
  if (arguments.out.empty()) return 0;
  const nlohmann::json report = {
      {"initialiser", arguments.initialiser},   {"estimate_warp", !arguments.no_warp},
      {"first_seed", arguments.first_seed},     {"trials_per_cloud", arguments.trials},
      {"cpu_ms_median", median_or_nan(all_ms)}, {"levels", rows}};
  if (const Status written = write_file_atomic(arguments.out, report.dump(1) + "\n"); !written) {
    fmt::print(stderr, "{}\n", written.error().message());
    return 1;
  }
}
