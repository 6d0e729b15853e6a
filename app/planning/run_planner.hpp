// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "app/pipeline/stage.hpp"
#include "app/planning/choices.hpp"
#include "app/planning/plan.hpp"

namespace orbitfuse::planning {

inline constexpr const char* plan_file = "plan.json";

/// What a planner starts from.
struct PlannerInput {
  double budget_s = 0;  ///< of the whole run, on the wall
  SceneFacts facts;
  std::vector<std::string> stages;    ///< of this run, in order
  double slowness = 1;                ///< measured_slowness()
  std::function<double()> elapsed_s;  ///< since the run began
  std::string session_content;        ///< decisions of another session don't count
  std::set<std::string> given = {};   ///< keys the user gave with this call: they stay
  bool afresh = false;                ///< whatever was planned before
};

/// Spends a run's time: says a plan first, then before each stage divides what is left anew, by
/// what the finished ones took against what was expected of them. What it decided stands in
/// out/plan.json: a run that is gone on with, or called again for the same, decides alike and finds
/// its stages unchanged.
class RunPlanner {
 public:
  /// Keys of `config` that were given, or differ from their defaults, are the user's and stay.
  RunPlanner(PlannerInput input, std::filesystem::path out, stages::RunConfig& config);

  /// The plan at the beginning, or the earlier one that is followed again.
  const Plan& first() const { return first_; }
  /// Seconds of all of it, with what came before the first stage.
  double first_total_s() const { return first_total_s_; }
  /// Nothing has been said of too little time.
  bool expects_to_hold() const { return first_.fits && !warned_; }
  /// "depth at 280 px, visible field 12 s ...": for the terminal.
  std::string described() const;
  /// What to tell the user of that plan; "": nothing.
  std::string remark() const;

  /// Settles the configuration of `stage`, which comes next. Returns what to warn of, once: that
  /// the budget can't be held any more.
  std::string decide(const std::string& stage, const std::vector<pipeline::StageStatus>& finished);
  /// Writes out/plan.json: the choices, and a table of what was expected and what came.
  Status save(const std::vector<pipeline::StageStatus>& finished) const;

 private:
  void follow_earlier(const nlohmann::json& earlier);
  void settle_what_the_user_set();
  bool comes(const char* stage) const;
  Plan plan_from(const std::string& stage) const;
  void choose(const std::string& stage, const Effort& effort);
  double slowness_after(const std::vector<pipeline::StageStatus>& finished) const;
  nlohmann::json made_for() const;
  nlohmann::json table(const std::vector<pipeline::StageStatus>& finished) const;

  PlannerInput input_;
  std::filesystem::path out_;
  stages::RunConfig& config_;
  double slowness_;                                  ///< as the finished stages tell it
  nlohmann::json users_ = nlohmann::json::object();  ///< planned keys that are the user's
  Settled settled_;
  bool followed_ = false, warned_ = false;
  Plan first_;
  double first_total_s_ = 0;
  Choices choices_;
};

}  // namespace orbitfuse::planning
