// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/progress.hpp"
#include "core/result.hpp"

namespace orbitfuse::pipeline {

/// What a stage says about its run; goes into stage.json and the report.
struct StageOutput {
  nlohmann::json metrics = nlohmann::json::object();
  std::vector<Skip> skips;
  std::vector<std::string> warnings;
};

enum class StageState {
  ran,        ///< ran now and is done
  unchanged,  ///< done before with the same inputs and options
  absent,     ///< nothing to do with these data
  blocked,    ///< a stage it needs is not done
  failed,     ///< see error
  planned,    ///< --dry-run: would run
};
std::string_view name(StageState state);

/// How one stage fared in this run.
struct StageStatus {
  std::string stage;
  StageState state = StageState::absent;
  std::string why;             ///< reason of absent, blocked and of a new run
  std::optional<Error> error;  ///< of failed
  StageOutput output;          ///< of ran and unchanged
  nlohmann::json options;
  double cpu_s = 0, wall_s = 0;  ///< of the run that made the outputs
  bool done() const { return state == StageState::ran || state == StageState::unchanged; }
};

/// A stage's last result that still stands, made from the same inputs by the same method.
struct EarlierResult {
  std::filesystem::path folder;
  nlohmann::json options, metrics;
};

/// What a stage may read and where it writes while it runs.
struct StageContext {
  std::filesystem::path out;     ///< folder of the whole run
  std::filesystem::path folder;  ///< the stage's own, private until it is done
  bool resume = false;           ///< `folder` holds an interrupted attempt with the same key
  Progress progress;
  /// What other options made of the same inputs, for a stage that can go on from there. Not with
  /// --force. Checked when it is asked for: reading all files of a result takes time.
  std::function<std::optional<EarlierResult>()> earlier_result;

  std::set<std::string> finished;                     ///< stages whose outputs belong to this run
  const std::vector<StageStatus>* earlier = nullptr;  ///< how the stages before fared

  bool has(const std::string& stage) const { return finished.count(stage) > 0; }
  /// Folder of a finished stage.
  std::filesystem::path of(const std::string& stage) const { return out / stage; }
  /// What a finished stage of this run said; nullptr when it isn't finished.
  const nlohmann::json* metrics_of(const std::string& stage) const {
    for (const StageStatus& status : *earlier)
      if (status.stage == stage && status.done()) return &status.output.metrics;
    return nullptr;
  }
};

/// One box of the data flow: reads finished stages, writes its own folder.
struct Stage {
  std::string name;                     ///< folder under out/
  int version = 1;                      ///< raised when the same inputs give another result
  std::vector<std::string> needs = {};  ///< can't run without these
  std::vector<std::string> uses = {};   ///< read when there; their absence changes the result
  nlohmann::json options = {};          ///< every resolved option that the result depends on
  std::string inputs_hash = {};  ///< of what it reads from outside out/ (session frames, files)
  /// Runs again although nothing changed (the report describes this very run).
  bool always = false;
  /// Why the session gives this stage nothing to do ("the session has no thermal frames"): known
  /// before any stage has run.
  std::optional<std::string> pointless = {};
  /// The like, as far as what it reads tells, once that is there.
  std::function<std::optional<std::string>(const StageContext&)> absent = {};
  std::function<Result<StageOutput>(const StageContext&)> run = {};
};

}  // namespace orbitfuse::pipeline
