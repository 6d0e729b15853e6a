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
using pipeline::StageState;
using pipeline::StageStatus;

constexpr int schema = 3;
/// The measured slowness counts like so many seconds of finished stages.
constexpr double probe_weight_s = 6;
/// Kept back for what no stage's figure has: a slow disk, a busy neighbour.
constexpr double reserve = 0.01;

const StageStatus* find(const std::vector<StageStatus>& finished, const std::string& stage) {
  const auto it = std::find_if(finished.begin(), finished.end(), [&](const StageStatus& status) {
    return status.stage == stage && status.done();
  });
  return it == finished.end() ? nullptr : &*it;
}

json to_json(const Plan& plan) {
  return {{"visible_steps", plan.effort.visible_steps},
          {"thermal_steps", plan.effort.thermal_steps},
          {"detail", plan.effort.detail},
          {"scored_views", plan.effort.scored_views},
          {"expected_s", plan.expected_s},
          {"fits", plan.fits},
          {"all_used", plan.all_used}};
}

std::optional<Plan> plan_of(const json& values) {
  try {
    Plan plan;
    values.at("visible_steps").get_to(plan.effort.visible_steps);
    values.at("thermal_steps").get_to(plan.effort.thermal_steps);
    values.at("detail").get_to(plan.effort.detail);
    values.at("scored_views").get_to(plan.effort.scored_views);
    values.at("expected_s").get_to(plan.expected_s);
    values.at("fits").get_to(plan.fits);
    values.at("all_used").get_to(plan.all_used);
    return plan;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

}  // namespace

RunPlanner::RunPlanner(PlannerInput input, std::filesystem::path out, stages::RunConfig& config)
    : input_(std::move(input)), out_(std::move(out)), config_(config), slowness_(input_.slowness) {
  settle_what_the_user_set();
  const auto text = read_file(out_ / plan_file);
  const json earlier = text ? parse_json(*text) : json();
  if (!input_.afresh && earlier.is_object()) follow_earlier(earlier);
  if (followed_) return;
  first_ = plan_from(input_.stages.empty() ? "" : input_.stages.front());
  first_total_s_ = first_.expected_s + input_.elapsed_s();
}

/// All that a plan depends on but the machine's speed, which differs from call to call.
json RunPlanner::made_for() const {
  return {{"schema", schema},
          {"budget_s", input_.budget_s},
          {"session_content", input_.session_content},
          {"stages", input_.stages},
          {"facts", to_json(input_.facts)},
          {"set by the user", users_}};
}

void RunPlanner::follow_earlier(const json& earlier) {
  const auto at = [&](const char* key) { return earlier.contains(key) ? earlier.at(key) : json(); };
  if (at("made_for") != made_for()) return;
  const auto plan = plan_of(at("plan"));
  if (!plan || !at("expected_total_s").is_number()) return;
  first_ = *plan;
  first_total_s_ = at("expected_total_s").get<double>();
  choices_ = choices_of(at("choices"));
  followed_ = true;
}

void RunPlanner::settle_what_the_user_set() {
  stages::RunConfig defaults;
  const json usual = planned_values(defaults), now = planned_values(config_);
  for (const auto& [key, value] : now.items())
    if (input_.given.count(key) > 0 || value != usual.at(key)) users_[key] = value;
  const auto steps = [&](const std::string& table, const nerf::TrainOptions& options,
                         double step_s) -> std::optional<int> {
    if (!users_.contains(table + ".budget_s") && !users_.contains(table + ".iterations"))
      return std::nullopt;
    const double in_time = options.budget_s > 0 ? options.budget_s / (step_s * slowness_) : 1e9;
    return static_cast<int>(std::min<double>(options.iterations, in_time));
  };
  settled_.visible_steps = steps("train.visible", config_.train_visible.options, visible_step_s());
  settled_.thermal_steps = steps("train.thermal", config_.train_thermal.options, thermal_step_s());
  if (users_.contains("render.detail_sources")) settled_.detail = true;
  if (users_.contains("metrics.scored_views")) settled_.scored_views = config_.metrics.scored_views;
}

bool RunPlanner::comes(const char* stage) const {
  return std::find(input_.stages.begin(), input_.stages.end(), stage) != input_.stages.end();
}

Plan RunPlanner::plan_from(const std::string& stage) const {
  const auto begin = std::find(input_.stages.begin(), input_.stages.end(), stage);
  const double left_s = (1 - reserve) * input_.budget_s - input_.elapsed_s();
  return make_plan(input_.facts, {begin, input_.stages.end()}, settled_, slowness_, left_s);
}

/// By stages whose seconds are this machine's and not the scene's, as those of poses are.
double RunPlanner::slowness_after(const std::vector<StageStatus>& finished) const {
  double expected_s = probe_weight_s, took_s = probe_weight_s * input_.slowness;
  const auto ran = [&](const char* stage) {
    const StageStatus* status = find(finished, stage);
    return status != nullptr && status->state == StageState::ran ? status : nullptr;
  };
  for (const char* stage : {"depth", "render"})
    if (const StageStatus* status = ran(stage)) {
      Effort done;
      done.detail = settled_.detail.value_or(done.detail);
      done.visible_steps = settled_.visible_steps.value_or(done.visible_steps);
      expected_s += stage_s(stage, input_.facts, done);
      took_s += status->wall_s;
    }
  const auto add_training = [&](const char* stage, double step_s) {
    const StageStatus* status = ran(stage);
    if (status == nullptr) return;
    // Of all steps, those of a training that was extended included.
    const json& metrics = status->output.metrics;
    const double steps = metrics.value("iterations", 0.0),
                 wall_s = metrics.value("train_wall_s", 0.0);
    if (steps > 0 && wall_s > 0) expected_s += steps * step_s, took_s += wall_s;
  };
  add_training("train_visible", visible_step_s());
  add_training("train_thermal", thermal_step_s());
  return took_s / expected_s;
}

void RunPlanner::choose(const std::string& stage, const Effort& effort) {
  const auto time_s = [&](int steps, double step_s) {
    return std::max(0.01, std::round(100 * steps * step_s * slowness_) / 100);
  };
  if (stage == "train_visible" && !settled_.visible_steps)
    choices_.visible_s = time_s(effort.visible_steps, visible_step_s());
  if (stage == "train_thermal" && !settled_.thermal_steps)
    choices_.thermal_s = time_s(effort.thermal_steps, thermal_step_s());
  if (stage == "render" && !settled_.detail)
    choices_.detail_sources = effort.detail ? config_.render.detail.sources : 0;
  if (stage == "metrics" && !settled_.scored_views) choices_.scored_views = effort.scored_views;
}

std::string RunPlanner::decide(const std::string& stage, const std::vector<StageStatus>& finished) {
  std::string warning;
  if (!choices_.made_for(stage)) {
    slowness_ = slowness_after(finished);
    const Plan plan = plan_from(stage);
    choose(stage, plan.effort);
    if (!plan.fits && first_.fits && !warned_) {
      warned_ = true;
      warning = fmt::format(
          "--budget: {} and what follows take about {:.0f} s with what ends soonest; the run "
          "will end after about {:.0f} s, not {:.0f} s",
          stage, plan.expected_s, input_.elapsed_s() + plan.expected_s, input_.budget_s);
    }
  }
  apply(choices_, config_);
  // What is decided is settled for the stages behind it.
  if (choices_.detail_sources) settled_.detail = *choices_.detail_sources > 0;
  const auto steps = [&](double time_s, double step_s) {
    return static_cast<int>(time_s / (step_s * slowness_));
  };
  if (choices_.visible_s) settled_.visible_steps = steps(*choices_.visible_s, visible_step_s());
  if (choices_.thermal_s) settled_.thermal_steps = steps(*choices_.thermal_s, thermal_step_s());
  return warning;
}

std::string RunPlanner::described() const {
  const Effort& effort = first_.effort;
  const SceneFacts& facts = input_.facts;
  std::vector<std::string> parts;
  const auto field = [&](const char* name, int steps, double step_s) {
    parts.push_back(
        fmt::format("{} field {:.0f} s ({} steps)", name, steps * step_s * input_.slowness, steps));
  };
  const bool visible = comes("train_visible") && facts.visible_views > 0,
             thermal = comes("train_thermal") && facts.thermal_views > 0;
  if (visible) field("visible", effort.visible_steps, visible_step_s());
  if (thermal) field("thermal", effort.thermal_steps, thermal_step_s());
  if (comes("render") && facts.detail_sources > 0 && !effort.detail)
    parts.emplace_back("new views without the recorded frames' detail");
  if (comes("metrics") && effort.scored_views > 0 && effort.scored_views < facts.new_views)
    parts.push_back(
        fmt::format("fusion scored on {} of {} views", effort.scored_views, facts.new_views));
  std::string text = fmt::format("{}{}; expected {:.0f} s", followed_ ? "as before, " : "",
                                 fmt::join(parts, ", "), first_total_s_);
  const ExpectedErrors errors = expected_errors(facts, effort);
  const bool tells_db = visible && facts.visible_measured,
             tells_k = thermal && comes("metrics") && facts.thermal_measured;
  if (tells_db)
    text += fmt::format(", {:.1f} +- {:.1f} dB", errors.visible_psnr_db, errors.visible_spread_db);
  if (tells_k)
    text += fmt::format(", {:.2f} +- {:.2f} K", errors.thermal_mae_k, errors.thermal_spread_k);
  return tells_db || tells_k ? text + " on held-out views" : text;
}

std::string RunPlanner::remark() const {
  const bool free = !settled_.visible_steps && !settled_.thermal_steps && comes("report");
  if (first_.fits && !first_.all_used && free)
    return fmt::format("more than {:.0f} s would bring nothing that was ever measured",
                       first_total_s_);
  return {};
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
  return {metric("train_visible", "heldout_psnr_db"),
          metric("metrics", "thermal_heldout_field_mae_k")};
}

}  // namespace

json RunPlanner::table(const std::vector<StageStatus>& finished) const {
  auto rows = json::array();
  for (const std::string& stage : input_.stages) {
    if (stage == "report") continue;  // it holds this table
    const double expected_s = stage_s(stage, input_.facts, first_.effort) * input_.slowness;
    const StageStatus* status = find(finished, stage);
    const double took_s = status != nullptr ? status->wall_s : 0;
    if (expected_s <= 0.05 && took_s <= 0.05) continue;
    const bool earlier = status != nullptr && status->state == StageState::unchanged;
    rows.push_back({stage, fmt::format("{:.1f} s", expected_s),
                    status == nullptr
                        ? ""
                        : fmt::format("{:.1f} s{}", took_s, earlier ? ", before this run" : "")});
  }
  rows.push_back({fmt::format("all, of {:.0f} s", input_.budget_s),
                  fmt::format("{:.1f} s", first_total_s_),
                  fmt::format("{:.1f} s so far", input_.elapsed_s())});
  const ExpectedErrors errors = expected_errors(input_.facts, first_.effort);
  const MeasuredErrors measured = errors_in(finished);
  if (measured.visible_psnr_db.is_number())
    rows.push_back(
        {"visible, held-out views",
         fmt::format("{:.1f} +- {:.1f} dB", errors.visible_psnr_db, errors.visible_spread_db),
         fmt::format("{:.1f} dB", measured.visible_psnr_db.get<double>())});
  if (measured.thermal_mae_k.is_number())
    rows.push_back(
        {"thermal, held-out views",
         fmt::format("{:.2f} +- {:.2f} K", errors.thermal_mae_k, errors.thermal_spread_k),
         fmt::format("{:.2f} K", measured.thermal_mae_k.get<double>())});
  const json columns = json::array(
      {json::array({"stage", "Of the run's budget"}),
       json::array({"expected", "Before the first stage; +- as far as most scenes lay from it"}),
       json::array({"came", "Wall seconds, and the errors the run measured"})});
  return {{"title", "Plan and outcome"}, {"columns", columns}, {"rows", rows}};
}

Status RunPlanner::save(const std::vector<StageStatus>& finished) const {
  const ExpectedErrors errors = expected_errors(input_.facts, first_.effort);
  const MeasuredErrors measured = errors_in(finished);
  const json plan = {
      {"schema", schema},
      {"budget_s", input_.budget_s},
      {"made_for", made_for()},
      {"slowness", slowness_},
      {"plan", to_json(first_)},
      {"expected_total_s", first_total_s_},
      {"expected",
       {{"visible_psnr_db", errors.visible_psnr_db}, {"thermal_mae_k", errors.thermal_mae_k}}},
      {"measured",
       {{"wall_s", input_.elapsed_s()},
        {"visible_psnr_db", measured.visible_psnr_db},
        {"thermal_mae_k", measured.thermal_mae_k}}},
      {"choices", planning::to_json(choices_)},
      {"table", table(finished)}};
  return write_file_atomic(out_ / plan_file, plan.dump(2) + "\n");
}

}  // namespace orbitfuse::planning
