// SPDX-License-Identifier: BSD-3-Clause
// Success, error and CPU time of registration on synthetic pairs.
//   bench_registration [--trials 20] [--cloud car] [--level "gap, hard"]
//     [--initialiser both|features|grid] [--verbose]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "bench/registration/scenes.hpp"
#include "core/parallel.hpp"
#include "recon/registration/register.hpp"

using namespace orbitfuse;

namespace {

struct Arguments {
  int trials = 20, first_seed = 0;
  std::string cloud, level, initialiser = "both";
  bool verbose = false;
};

struct Tally {
  int trials = 0, good = 0, flagged_wrong = 0, flagged_good = 0, errors = 0;
  std::vector<double> cpu_ms, rotation_deg, scale_percent, rmse_percent;
  std::vector<double> near_rotation_deg, near_scale_percent, near_rmse_percent, near_cpu_ms;
};

double median(std::vector<double> values) {
  if (values.empty()) return NAN;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

double scale_error_percent(const Similarity3d& a, const Similarity3d& b) {
  return 100 * std::abs(a.scale / b.scale - 1);
}

/// Refinement alone, from 3 degrees and 3 % off, turned about the object's middle.
void run_refinement(const bench::CloudPair& pair, std::uint32_t seed, Tally& tally) {
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
  const auto refined = refine_registration(pair.source, pair.target, kick * truth, {});
  if (!refined) return;
  tally.near_rotation_deg.push_back(
      rotation_angle_deg(refined->target_from_source.rotation, truth.rotation));
  tally.near_scale_percent.push_back(scale_error_percent(refined->target_from_source, truth));
  tally.near_rmse_percent.push_back(bench::surface_rmse_percent(pair, refined->target_from_source));
  tally.near_cpu_ms.push_back(1000 * refined->cpu_s);
}

void run_trial(const bench::CloudPair& pair, const Arguments& arguments, const std::string& label,
               std::uint32_t seed, Tally& tally) {
  ++tally.trials;
  RegistrationOptions options;
  options.seed = seed + 1;
  options.use_features = arguments.initialiser != "grid";
  options.use_grid = arguments.initialiser != "features";
  const auto report = register_clouds(pair.source, pair.target, options, {});
  if (!report) {
    ++tally.errors;
    if (arguments.verbose) fmt::print("  {} seed {}: {}\n", label, seed, report.error().message());
    return;
  }
  const Similarity3d& truth = pair.target_from_source;
  const double rotation = rotation_angle_deg(report->target_from_source.rotation, truth.rotation);
  const double scale = scale_error_percent(report->target_from_source, truth);
  const bool good = rotation < 5 && scale < 5;
  tally.good += good;
  tally.flagged_wrong += !good && report->ambiguous;
  tally.flagged_good += good && report->ambiguous;
  tally.cpu_ms.push_back(1000 * report->cpu_s);
  if (good) {
    tally.rotation_deg.push_back(rotation);
    tally.scale_percent.push_back(scale);
    tally.rmse_percent.push_back(bench::surface_rmse_percent(pair, report->target_from_source));
  }
  if (arguments.verbose && (!good || arguments.trials < 4)) {
    bool among = false;
    for (const auto& a : report->alternatives) {
      among |= rotation_angle_deg(a.target_from_source.rotation, truth.rotation) < 5 &&
               scale_error_percent(a.target_from_source, truth) < 5;
    }
    const auto oracle = refine_registration(pair.source, pair.target, truth, options);
    fmt::print(
        "  {} seed {}: {:.1f} deg, {:.1f} %, {:.0f} ms; truth among alternatives: {}, truth's "
        "evidence {:.3f}; runner-up {:.3f}; {}\n",
        label, seed, rotation, scale, 1000 * report->cpu_s, among, oracle ? oracle->evidence : -1,
        report->alternatives.empty() ? 0 : report->alternatives[0].evidence, report->brief());
    std::fflush(stdout);
  }
}

Arguments parse(int argc, char** argv) {
  Arguments a;
  for (int i = 1; i < argc; ++i) {
    const auto is = [&](const char* name) {
      return !std::strcmp(argv[i], name) && (i + 1 < argc || !std::strcmp(name, "--verbose"));
    };
    if (is("--verbose"))
      a.verbose = true;
    else if (is("--trials"))
      a.trials = std::atoi(argv[++i]);
    else if (is("--first-seed"))
      a.first_seed = std::atoi(argv[++i]);
    else if (is("--cloud"))
      a.cloud = argv[++i];
    else if (is("--level"))
      a.level = argv[++i];
    else if (is("--initialiser"))
      a.initialiser = argv[++i];
    else {
      fmt::print(stderr, "unknown argument {}\n", argv[i]);
      std::exit(2);
    }
  }
  return a;
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = parse(argc, argv);
  set_thread_count(1);
  std::vector<std::pair<std::string, bench::Surface>> surfaces;
  for (const char* name : {"bunny", "indoor", "car"}) {
    if (!arguments.cloud.empty() && arguments.cloud != name) continue;
    if (auto s = bench::surface(name))
      surfaces.emplace_back(name, *s);
    else
      fmt::print("{}: skipped, not in the shared data\n", name);
  }
  fmt::print(
      "| level | success (bar) | per cloud | wrong: flagged | right: flagged | rot deg / scale % / "
      "RMSE % | CPU ms median (max) | refinement: rot / scale / RMSE, ms "
      "|\n|---|---|---|---|---|---|---|---|\n");
  std::vector<double> all_ms;
  for (std::size_t l = 0; l < bench::levels().size(); ++l) {
    const bench::Level& level = bench::levels()[l];
    if (!arguments.level.empty() && arguments.level != level.name) continue;
    Tally total;
    std::string per_cloud;
    for (const auto& [name, surface] : surfaces) {
      const int before = total.good;
      for (int trial = 0; trial < arguments.trials; ++trial) {
        const auto seed = static_cast<std::uint32_t>(arguments.first_seed + trial) * 1000u +
                          static_cast<std::uint32_t>(l);
        const bench::CloudPair pair = bench::make_pair(surface, level, seed);
        run_trial(pair, arguments, level.name + " " + name, seed, total);
        run_refinement(pair, seed, total);
      }
      per_cloud += fmt::format("{}{} {}", per_cloud.empty() ? "" : ", ", name, total.good - before);
    }
    all_ms.insert(all_ms.end(), total.cpu_ms.begin(), total.cpu_ms.end());
    fmt::print(
        "| {} | {}/{} = {:.0f} % ({:.0f}) | {} | {}/{} | {}/{} | {:.2f} / {:.2f} / {:.2f} | {:.0f} "
        "({:.0f}) | {:.2f} / {:.2f} / {:.2f}, {:.0f} |\n",
        level.name, total.good, total.trials, 100.0 * total.good / total.trials,
        100 * level.success_bar, per_cloud, total.flagged_wrong + total.errors,
        total.trials - total.good, total.flagged_good, total.good, median(total.rotation_deg),
        median(total.scale_percent), median(total.rmse_percent), median(total.cpu_ms),
        total.cpu_ms.empty() ? 0 : *std::max_element(total.cpu_ms.begin(), total.cpu_ms.end()),
        median(total.near_rotation_deg), median(total.near_scale_percent),
        median(total.near_rmse_percent), median(total.near_cpu_ms));
    std::fflush(stdout);
  }
  fmt::print("median over all pairs: {:.0f} CPU ms\n", median(all_ms));
}
