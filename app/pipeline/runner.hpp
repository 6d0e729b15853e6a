// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/pipeline/stage.hpp"
#include "app/pipeline/stage_record.hpp"

namespace orbitfuse::pipeline {

struct RunOptions {
  std::filesystem::path out;              ///< holds one folder a stage
  std::vector<std::string> targets = {};  ///< stages wanted, with all they read; empty = all
  bool force = false;                     ///< run the targets although they are unchanged
  bool resume = false;   ///< go on from an interrupted attempt where its key matches
  bool dry_run = false;  ///< say what would run, write nothing
  /// What lies in `out` is of other inputs: `replaced_files` there, which tell of it, and then
  /// every stage's folder are removed before the first one runs.
  bool replace_all = false;
  std::vector<std::string> replaced_files = {};
  bool targets_only = false;  ///< what the targets read is taken as it lies there, never run
};

struct RunSummary {
  std::vector<StageStatus> stages;  ///< in order
  std::optional<Error> error;       ///< the first failure; earlier outputs are intact
  const StageStatus* find(const std::string& stage) const;
};

/// Runs stages in the given order (each after all it reads). A stage whose key, i.e. the content
/// hash of its inputs, resolved options and version, matches its done mark is left as it is. A
/// stage works in out/.partial/<stage> and replaces out/<stage> only when done, so that a failure,
/// Ctrl-C or a crash never costs an earlier result. After a failed gate or input the branches that
/// don't depend on it still run; a device or usage error, or Ctrl-C, stops at once.
class Runner {
 public:
  Runner(std::vector<Stage> stages, RunOptions options, Progress progress);

  /// Called when a stage starts (state planned) and when its state is known.
  std::function<void(const StageStatus&)> on_status = [](const StageStatus&) {};
  /// May settle a stage's options anew just before it is looked at, by how the others fared.
  std::function<void(Stage&, const std::vector<StageStatus>&)> before_stage =
      [](Stage&, const std::vector<StageStatus>&) {};
  RunSummary run();

 private:
  struct Key {
    std::string hash;
    std::map<std::string, std::string> inputs;
  };

  bool is_target(const std::string& stage) const;
  bool wanted(const std::string& stage) const;
  /// Wanted, and made where it doesn't hold.
  bool writes(const std::string& stage) const;
  Key key_of(const Stage& stage) const;
  bool forced(const Stage& stage) const;
  StageContext context(std::filesystem::path folder, bool resume) const;
  std::optional<EarlierResult> earlier_result(const Stage& stage, const Key& key) const;
  Status remove_all() const;
  std::optional<std::string> earlier_input(const StageRecord& record) const;
  std::optional<std::string> unfit_as_it_lies(const Stage& stage, const Result<StageRecord>& record,
                                              StageStatus& status);
  StageStatus visit(const Stage& stage);
  StageStatus execute(const Stage& stage, const Key& key, std::string why);
  /// None: what it made still holds.
  std::optional<std::string> why_run(const Stage& stage, const Key& key,
                                     const Result<StageRecord>& record) const;

  std::vector<Stage> stages_;
  RunOptions options_;
  Progress progress_;
  std::vector<std::string> closure_;
  std::vector<StageStatus> statuses_;
  std::map<std::string, std::string> outputs_;  ///< done stage -> outputs hash
  std::set<std::string> outdated_;  ///< left aside: made of stages that were made anew since
};

/// The targets (empty: all) and all they read, in order.
std::vector<std::string> closure(const std::vector<Stage>& stages,
                                 const std::vector<std::string>& targets);

/// Version string stored with every result.
std::string software_version();

}  // namespace orbitfuse::pipeline
