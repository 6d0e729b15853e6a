// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/training_limits.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>

namespace orbitfuse::cli {
namespace {

constexpr int target_evaluations = 24;  // a target is seen within a 24th of the run

}  // namespace

void add_limits(CLI::App& app, TrainingLimits& limits) {
  app.add_option(
         "--budget", limits.budget,
         "Time to train each field, e.g. 60s, 2m, 1m30s; replaces the recipe's number of steps")
      ->type_name("DURATION");
  add_target(app, limits);
}

void add_target(CLI::App& app, TrainingLimits& limits) {
  app.add_option("--target-psnr", limits.target_psnr,
                 "Stop training when the held-out views reach it, in dB")
      ->check(CLI::Range(1.0, 100.0))
      ->check(CLI::Validator(
          [](const std::string& word) {  // which lies in every range of CLI11's
            return std::isnan(std::strtod(word.c_str(), nullptr)) ? "'" + word + "' is no number"
                                                                  : std::string();
          },
          ""))
      ->type_name("DB");
}

Result<double> parse_duration(const std::string& text) {
  double seconds = 0, last_unit = 1e30;
  const char *at = text.data(), *end = at + text.size();
  bool valid = at != end;
  while (valid && at != end) {
    double value = 0;
    const auto [next, error] = std::from_chars(at, end, value, std::chars_format::fixed);
    // A number alone is seconds; after another unit it could be anything.
    const char letter = next != end ? *next : at == text.data() ? 's' : '?';
    const double unit = letter == 's' ? 1 : letter == 'm' ? 60 : letter == 'h' ? 3600 : 0;
    valid = error == std::errc() && value >= 0 && unit > 0 && unit < last_unit;
    seconds += value * unit;
    last_unit = unit;
    at = next == end ? end : next + 1;
  }
  if (!valid || !(seconds > 0) || !std::isfinite(seconds))
    return fail(ErrorKind::usage, "--budget", "'" + text + "'",
                "write a duration such as 60s, 2m or 1m30s");
  return seconds;
}

Status apply(const TrainingLimits& limits, const std::vector<Modality>& fields,
             stages::RunConfig& config) {
  double budget_s = 0;
  if (limits.budget) {
    ORBITFUSE_ASSIGN(budget_s, parse_duration(*limits.budget));
  }
  for (const Modality field : fields) {
    nerf::TrainOptions& options =
        field == Modality::visible ? config.train_visible.options : config.train_thermal.options;
    if (budget_s > 0) {
      options.budget_s = budget_s;
      options.iterations = stages::unlimited_steps;
    }
    if (limits.target_psnr > 0) {
      options.target_psnr = limits.target_psnr;
      options.eval_count = std::max(options.eval_count, target_evaluations);
    }
  }
  return config.validate();
}

}  // namespace orbitfuse::cli
