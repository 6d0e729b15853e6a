// SPDX-License-Identifier: BSD-3-Clause
#include "app/planning/run_planner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::planning {
namespace {
using nlohmann::json;
using pipeline::StageStatus;

constexpr int schema = 1;
/// The measured slowness counts like so many seconds of finished stages.
constexpr double probe_weight_s = 6;
/// Kept back for what no stage's figure has: a slow disk, a busy neighbour.
constexpr double reserve = 0.01;
/// Time ends a training, not steps; a field that takes them faster than expected gets more.
constexpr double headroom = 1.25;
/// Whose seconds are this machine's, not the scene's.
constexpr const char* tell_the_machine[] = {"depth", "train_visible", "train_thermal", "render"};

bool known(const json& plan) {
  const auto has = [&](const char* key, auto is) {
    return plan.contains(key) && (plan.at(key).*is)();
  };
  return plan.is_object() && has("schema", &json::is_number_integer) &&
         plan.at("schema") == schema && has("budget_s", &json::is_number) &&
         has("session_content", &json::is_string) && has("choices", &json::is_object);
}

json read_plan(const std::filesystem::path& out) {
  const auto text = read_file(out / plan_file);
  const json plan = text ? parse_json(*text) : json();
  return known(plan) ? plan : json();
}

double wall_s(const std::vector<StageStatus>& finished) {
  double sum = 0;
  for (const StageStatus& status : finished)
    if (status.done() || status.error) sum += status.wall_s;
  return sum;
}

const StageStatus* find(const std::vector<StageStatus>& finished, const std::string& stage) {
  const auto it = std::find_if(finished.begin(), finished.end(), [&](const StageStatus& status) {
    return status.stage == stage && status.done();
  });
  return it == finished.end() ? nullptr : &*it;
}

/// Dotted keys as a configuration file nests them.
json nested(const json& choice) {
  json tree = json::object();
  for (const auto& [key, value] : choice.items()) {
    json* at = &tree;
    std::size_t begin = 0;
    for (std::size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.', begin)) {
      at = &(*at)[key.substr(begin, dot - begin)];
      begin = dot + 1;
    }
    (*at)[key.substr(begin)] = value;
  }
  return tree;
}

}  // namespace

RunPlanner::RunPlanner(PlannerInput input, std::filesystem::path out, stages::RunConfig& config,
                       bool afresh)
    : input_(std::move(input)), out_(std::move(out)), config_(config), slowness_(input_.slowness) {
  const json earlier = read_plan(out_);
  if (!earlier.is_null()) take_back_earlier_choices(earlier);
  settle_what_the_user_set();
  first_ = plan_from(input_.stages.empty() ? "" : input_.stages.front(),
                     (1 - reserve) * input_.budget_s - input_.spent_s);
  const bool same = !afresh && !earlier.is_null() && earlier.at("budget_s") == input_.budget_s &&
                    earlier.at("session_content") == input_.session_content;
  if (same)
    for (const auto& [stage, choice] : earlier["choices"].items())
      if (choice.is_object()) choices_[stage] = choice;
}

void RunPlanner::take_back_earlier_choices(const json& earlier) {
  stages::RunConfig defaults;
  const json now = config_.settings().to_json(), usual = defaults.settings().to_json();
  const auto at = [](const json& tree, std::string key) {
    std::replace(key.begin(), key.end(), '.', '/');
    const json::json_pointer where("/" + key);
    return tree.contains(where) ? tree.at(where) : json();
  };
  for (const auto& [stage, choice] : earlier.at("choices").items()) {
    if (!choice.is_object()) continue;
    for (const auto& [key, value] : choice.items())
      if (at(now, key) == value)
        (void)config_.settings().read_json(nested({{key, at(usual, key)}}), plan_file);
  }
}

void RunPlanner::settle_what_the_user_set() {
  const stages::RunConfig usual;
  const auto given = [](int value, int normal) {
    return value == normal ? std::optional<int>() : value;
  };
  settled_.depth_width_px = given(config_.depth.width_px, usual.depth.width_px);
  settled_.visible_steps =
      given(config_.train_visible.options.iterations, usual.train_visible.options.iterations);
  settled_.thermal_steps =
      given(config_.train_thermal.options.iterations, usual.train_thermal.options.iterations);
  settled_.scored_views = given(config_.metrics.scored_views, usual.metrics.scored_views);
}

Plan RunPlanner::plan_from(const std::string& stage, double available_s) const {
  const auto begin = std::find(input_.stages.begin(), input_.stages.end(), stage);
  return make_plan(input_.facts, {begin, input_.stages.end()}, settled_, slowness_, available_s);
}

double RunPlanner::slowness_after(const std::vector<StageStatus>& finished) const {
  double expected_s = probe_weight_s, took_s = probe_weight_s * input_.slowness;
  for (const char* stage : tell_the_machine) {
    const StageStatus* status = find(finished, stage);
    if (status == nullptr) continue;
    Effort done;
    done.depth_width_px = config_.depth.width_px;
    if (const int steps = status->output.metrics.value("iterations", 0); steps > 0)
      done.visible_steps = done.thermal_steps = steps;
    expected_s += stage_s(stage, input_.facts, done);
    took_s += status->wall_s;
  }
  return took_s / expected_s;
}

json RunPlanner::choice_for(const std::string& stage, const Plan& plan) const {
  json choice = json::object();
  const Effort& effort = plan.effort;
  const auto add_training = [&](const std::string& table, int steps, double step_s) {
    choice[table + ".iterations"] = static_cast<int>(headroom * steps);
    choice[table + ".budget_s"] = std::round(100 * steps * step_s * slowness_) / 100;
  };
  if (stage == "depth" && !settled_.depth_width_px)
    choice["depth.width_px"] = effort.depth_width_px;
  if (stage == "train_visible") {
    if (!settled_.visible_steps)
      add_training("train.visible", effort.visible_steps, visible_step_s());
  }
  if (stage == "train_thermal" && !settled_.thermal_steps)
    add_training("train.thermal", effort.thermal_steps, thermal_step_s());
  if (stage == "metrics" && !settled_.scored_views)
    choice["metrics.scored_views"] = effort.scored_views;
  return choice;
}

void RunPlanner::apply(const json& choice) {
  // What doesn't fit any more, of a damaged file, is left as it is: a default.
  (void)config_.settings().read_json(nested(choice), plan_file);
  const auto settle = [&](const char* key, double value, std::optional<int>& settled) {
    if (choice.contains(key)) settled = static_cast<int>(value);
  };
  settle("depth.width_px", config_.depth.width_px, settled_.depth_width_px);
  settle("train.visible.iterations", config_.train_visible.options.iterations / headroom,
         settled_.visible_steps);
  settle("train.thermal.iterations", config_.train_thermal.options.iterations / headroom,
         settled_.thermal_steps);
  settle("metrics.scored_views", config_.metrics.scored_views, settled_.scored_views);
}

void RunPlanner::decide(const std::string& stage, const std::vector<StageStatus>& finished) {
  if (choices_.count(stage) == 0) {
    slowness_ = slowness_after(finished);
    const double available_s = (1 - reserve) * input_.budget_s - input_.spent_s - wall_s(finished);
    const json choice = choice_for(stage, plan_from(stage, available_s));
    if (choice.empty()) return;
    choices_[stage] = choice;
  }
  apply(choices_[stage]);
}

std::string RunPlanner::described() const {
  const Effort& effort = first_.effort;
  const SceneFacts& facts = input_.facts;
  std::vector<std::string> parts;
  if (facts.visible_views > 0) {
    if (facts.visible_views > 1)
      parts.push_back(fmt::format("depth at {} px", effort.depth_width_px));
    parts.push_back(fmt::format("visible field {:.0f} s ({} steps)",
                                effort.visible_steps * visible_step_s() * slowness_,
                                effort.visible_steps));
  }
  if (facts.thermal_views > 0)
    parts.push_back(fmt::format("thermal field {:.0f} s ({} steps)",
                                effort.thermal_steps * thermal_step_s() * slowness_,
                                effort.thermal_steps));
  if (effort.scored_views > 0 && effort.scored_views < facts.new_views)
    parts.push_back(
        fmt::format("fusion scored on {} of {} views", effort.scored_views, facts.new_views));
  std::string text = fmt::format("{}", fmt::join(parts, ", "));
  const ExpectedErrors errors = expected_errors(facts, effort);
  text += fmt::format("; expected {:.0f} s", first_.expected_s + input_.spent_s);
  if (facts.visible_views > 0)
    text += fmt::format(", {:.1f} +- {:.1f} dB", errors.visible_psnr_db, errors.visible_spread_db);
  if (facts.thermal_views > 0)
    text += fmt::format(", {:.2f} +- {:.2f} K", errors.thermal_mae_k, errors.thermal_spread_k);
  return text + " on held-out views";
}

namespace {

/// Of the held-out views; null: not measured.
struct MeasuredErrors {
  json visible_psnr_db, thermal_mae_k;
};

MeasuredErrors errors_in(const std::vector<StageStatus>& finished) {
  const auto metric = [&](const char* stage, const char* key) {
    const StageStatus* status = find(finished, stage);
    return status != nullptr ? status->output.metrics.value(key, json()) : json();
  };
  return {metric("train_visible", "heldout_psnr_db"), metric("metrics", "thermal_heldout_mae_k")};
}

}  // namespace

json RunPlanner::table(const std::vector<StageStatus>& finished) const {
  auto rows = json::array();
  const auto row = [&](const std::string& name, const std::string& expected,
                       const std::string& came) {
    rows.push_back({name, expected, came});
  };
  double took_s = input_.spent_s;
  for (const std::string& stage : input_.stages) {
    const double expected_s = stage_s(stage, input_.facts, first_.effort) * input_.slowness;
    const StageStatus* status = find(finished, stage);
    if (status != nullptr) took_s += status->wall_s;
    if (expected_s > 0.05 || (status != nullptr && status->wall_s > 0.05))
      row(stage, fmt::format("{:.1f} s", expected_s),
          status != nullptr ? fmt::format("{:.1f} s", status->wall_s) : "");
  }
  row("all, of " + fmt::format("{:.0f} s", input_.budget_s),
      fmt::format("{:.1f} s", first_.expected_s + input_.spent_s), fmt::format("{:.1f} s", took_s));
  const ExpectedErrors errors = expected_errors(input_.facts, first_.effort);
  const MeasuredErrors measured = errors_in(finished);
  if (measured.visible_psnr_db.is_number())
    row("visible, held-out views",
        fmt::format("{:.1f} +- {:.1f} dB", errors.visible_psnr_db, errors.visible_spread_db),
        fmt::format("{:.1f} dB", measured.visible_psnr_db.get<double>()));
  if (measured.thermal_mae_k.is_number())
    row("thermal, held-out views",
        fmt::format("{:.2f} +- {:.2f} K", errors.thermal_mae_k, errors.thermal_spread_k),
        fmt::format("{:.2f} K", measured.thermal_mae_k.get<double>()));
  const json columns =
      json::array({json::array({"stage", "Of the run's budget"}),
                   json::array({"expected", "Before the first stage; +- holds nine scenes of ten"}),
                   json::array({"came", "Wall seconds, and the errors the run measured"})});
  return {{"title", "Plan and outcome"}, {"columns", columns}, {"rows", rows}};
}

Status RunPlanner::save(const std::vector<StageStatus>& finished) const {
  const ExpectedErrors errors = expected_errors(input_.facts, first_.effort);
  const MeasuredErrors measured = errors_in(finished);
  const json plan = {
      {"schema", schema},
      {"budget_s", input_.budget_s},
      {"session_content", input_.session_content},
      {"slowness", slowness_},
      {"fits", first_.fits},
      {"expected",
       {{"wall_s", first_.expected_s + input_.spent_s},
        {"visible_psnr_db", errors.visible_psnr_db},
        {"thermal_mae_k", errors.thermal_mae_k}}},
      {"measured",
       {{"visible_psnr_db", measured.visible_psnr_db}, {"thermal_mae_k", measured.thermal_mae_k}}},
      {"choices", choices_},
      {"table", table(finished)}};
  return write_file_atomic(out_ / plan_file, plan.dump(2) + "\n");
}

}  // namespace orbitfuse::planning
