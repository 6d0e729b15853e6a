// SPDX-License-Identifier: BSD-3-Clause
#include "app/planning/choices.hpp"

#include <algorithm>
#include <iterator>

namespace orbitfuse::planning {
using nlohmann::json;

bool Choices::made_for(const std::string& stage) const {
  if (stage == "train_visible") return visible_s.has_value();
  if (stage == "train_thermal") return thermal_s.has_value();
  if (stage == "render") return detail_sources.has_value();
  return stage == "metrics" && scored_views.has_value();
}

void apply(const Choices& choices, stages::RunConfig& config) {
  const auto limit = [](const std::optional<double>& time_s, nerf::TrainOptions& options) {
    if (!time_s) return;
    options.budget_s = *time_s;
    options.iterations = stages::unlimited_steps;
  };
  limit(choices.visible_s, config.train_visible.options);
  limit(choices.thermal_s, config.train_thermal.options);
  if (choices.detail_sources) config.render.detail.sources = *choices.detail_sources;
  if (choices.scored_views) config.metrics.scored_views = *choices.scored_views;
}

json to_json(const Choices& choices) {
  json values = json::object();
  const auto add = [&](const char* key, const auto& choice) {
    if (choice) values[key] = *choice;
  };
  add("train.visible.budget_s", choices.visible_s);
  add("train.thermal.budget_s", choices.thermal_s);
  add("render.detail_sources", choices.detail_sources);
  add("metrics.scored_views", choices.scored_views);
  return values;
}

Choices choices_of(const json& values) {
  Choices choices;
  const auto number = [&](const char* key) -> std::optional<double> {
    const bool there = values.is_object() && values.contains(key) && values.at(key).is_number();
    return there ? std::optional(values.at(key).get<double>()) : std::nullopt;
  };
  const auto whole = [&](const char* key) -> std::optional<int> {
    const auto value = number(key);
    const bool fits = value && *value >= 0 && *value <= 1e6;  // and isn't NaN
    return fits ? std::optional(static_cast<int>(*value)) : std::nullopt;
  };
  choices.visible_s = number("train.visible.budget_s");
  choices.thermal_s = number("train.thermal.budget_s");
  choices.detail_sources = whole("render.detail_sources");
  choices.scored_views = whole("metrics.scored_views");
  stages::RunConfig tried;
  apply(choices, tried);
  const auto ends = [](const std::optional<double>& time_s) { return !time_s || *time_s > 0; };
  return tried.validate() && ends(choices.visible_s) && ends(choices.thermal_s) ? choices
                                                                                : Choices();
}

json planned_values(stages::RunConfig& config) {
  json values = json::object();
  const config::Settings settings = config.settings();
  for (const config::Setting& setting : settings.list())
    if (std::count(std::begin(planned_keys), std::end(planned_keys), setting.key) > 0)
      values[setting.key] = setting.get();
  return values;
}

}  // namespace orbitfuse::planning
