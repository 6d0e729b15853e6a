// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "app/stages/run_config.hpp"

namespace orbitfuse::planning {

/// What a planner has settled of a run, one choice a stage; absent: not yet, or the user's.
struct Choices {
  std::optional<double> visible_s = {}, thermal_s = {};  ///< train_visible, train_thermal
  std::optional<int> detail_sources = {};                ///< render
  std::optional<int> scored_views = {};                  ///< metrics

  bool made_for(const std::string& stage) const;
};

/// Puts them into a configuration. Time ends a training, not its steps.
void apply(const Choices& choices, stages::RunConfig& config);

nlohmann::json to_json(const Choices& choices);
/// Absent is what is malformed, or what no run may have.
Choices choices_of(const nlohmann::json& values);

/// Keys of the configuration that a plan may set.
inline constexpr const char* planned_keys[] = {"train.visible.iterations", "train.visible.budget_s",
                                               "train.thermal.iterations", "train.thermal.budget_s",
                                               "render.detail_sources",    "metrics.scored_views"};

/// Their values, by key.
nlohmann::json planned_values(stages::RunConfig& config);

}  // namespace orbitfuse::planning
