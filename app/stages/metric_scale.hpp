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

nlohmann::json to_json(const MetricScale& scale);

/// "1.6 % in 90 of 100 cases": what every place says that tells a person of the uncertainty.
std::string uncertainty_words(const MetricScale& scale);

}  // namespace orbitfuse::stages
