// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "core/result.hpp"

namespace orbitfuse::stages {

/// How long the unit of a run's world is. Nothing in images says it: it is always told or measured.
struct MetricScale {
  double metres_per_unit = 1;
  double relative_uncertainty = 0;  ///< one standard deviation
  std::string source;               ///< "one distance", "mat", "known poses"
  std::string how;                  ///< in words, for whoever reads the file

  /// Errors: input (a scale that no length has).
  Status validate(const std::string& where) const;
};

inline constexpr const char* scale_file = "scale.json";

/// scale.json in the run's folder. `world`: the hash of the poses that the scale belongs to; with
/// other poses it is another unit, and the file is refused.
Status save_metric_scale(const std::filesystem::path& out, const std::string& world,
                         const MetricScale& scale);
/// Nothing where no scale was told. Errors: input (damaged, of other poses).
Result<std::optional<MetricScale>> load_metric_scale(const std::filesystem::path& out,
                                                     const std::string& world);
/// Of the run's poses. Errors: input (no finished poses).
Result<std::string> world_identity(const std::filesystem::path& out);
/// The scale that stays with a run: load_metric_scale of its own world. Nothing only where there is
/// no file.
Result<std::optional<MetricScale>> scale_of_run(const std::filesystem::path& out);

/// Two that were told of one world: their mean by their uncertainties, or the surer one where both
/// have one source and so perhaps one error; nothing where they differ by more than three standard
/// deviations, so that one of them is wrong.
std::optional<MetricScale> agreed_scale(const MetricScale& a, const MetricScale& b);

nlohmann::json to_json(const MetricScale& scale);

/// "1.6 % in 90 of 100 cases": what every place says that tells a person of the uncertainty.
std::string uncertainty_words(const MetricScale& scale);
/// A sentence without its full stop: how long a unit is, that no scale is known, or why the one
/// that there is can't be used, so that nobody reads metres that nobody vouches for.
std::string scale_words(const Result<std::optional<MetricScale>>& scale);

}  // namespace orbitfuse::stages
