// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "app/pipeline/stage.hpp"
#include "app/planning/plan.hpp"

namespace orbitfuse::planning {

inline constexpr const char* plan_file = "plan.json";

/// What a planner starts from.
struct PlannerInput {
  double budget_s = 0;  ///< of the whole run, on the wall
  SceneFacts facts;
  std::vector<std::string> stages;  ///< of this run, in order
  double slowness = 1;              ///< measured_slowness()
  double spent_s = 0;               ///< before the first stage
  std::string session_content;      ///< decisions of another session don't count
};

/// Spends a run's time: says a plan first, then before each stage divides what is left anew, by
/// what the finished ones took against what was expected of them. What it decided stands in
/// out/plan.json, so that a run that is gone on with, or called again, decides alike and finds its
/// stages unchanged.
class RunPlanner {
 public:
  /// Keys of `config` that differ from their defaults are the user's and stay, unless they are what
  /// an earlier plan in `out` chose.
  RunPlanner(PlannerInput input, std::filesystem::path out, stages::RunConfig& config, bool afresh);

  /// The plan at the beginning.
  const Plan& first() const { return first_; }
  /// "depth at 280 px, visible field 12 s ...": for the terminal.
  std::string described() const;

  /// Settles the configuration of `stage`, which comes next.
  void decide(const std::string& stage, const std::vector<pipeline::StageStatus>& finished);
  /// Writes out/plan.json: the choices, and a table of what was expected and what came.
  Status save(const std::vector<pipeline::StageStatus>& finished) const;

 private:
  void take_back_earlier_choices(const nlohmann::json& earlier);
  void settle_what_the_user_set();
  Plan plan_from(const std::string& stage, double available_s) const;
  double slowness_after(const std::vector<pipeline::StageStatus>& finished) const;
  void apply(const nlohmann::json& choice);
  nlohmann::json table(const std::vector<pipeline::StageStatus>& finished) const;
  nlohmann::json choice_for(const std::string& stage, const Plan& plan) const;

  PlannerInput input_;
  std::filesystem::path out_;
  stages::RunConfig& config_;
  double slowness_;  ///< as the finished stages tell it
  Settled settled_;
  Plan first_;
  std::map<std::string, nlohmann::json> choices_;
};

}  // namespace orbitfuse::planning
