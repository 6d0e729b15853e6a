// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/cli/verb.hpp"

namespace orbitfuse::cli {

/// How long fields are trained, as options of a verb.
struct TrainingLimits {
  std::optional<std::string> budget;  ///< a duration
  double target_psnr = 0;             ///< dB; 0 = none
};

void add_limits(CLI::App& app, TrainingLimits& limits);
/// The error alone, of a verb whose time is planned.
void add_target(CLI::App& app, TrainingLimits& limits);

/// Puts the limits into the recipes of the fields named ("visible", "thermal").
Status apply(const TrainingLimits& limits, const std::vector<Modality>& fields,
             stages::RunConfig& config);

/// Seconds of "90", "60s", "2m", "1.5h", "1m30s"; a usage error for anything else, or nothing at
/// all.
Result<double> parse_duration(const std::string& text);

}  // namespace orbitfuse::cli
