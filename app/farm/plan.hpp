// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse::farm {

inline constexpr int plan_schema = 2;
inline constexpr const char* plan_file = "farm.json";

/// What one stage of one session takes; Slurm is asked for it, and the local farm admits by it.
struct StageNeeds {
  int cores = 2;
  double memory_mb = 2000;
  double time_min = 60;                ///< the most it may take
  bool gpu = false;                    ///< goes to the GPU partition, where one is named
  std::optional<double> usual_s = {};  ///< wall seconds that it takes as a rule, where known
  bool operator==(const StageNeeds&) const = default;
};

struct FarmSession {
  std::string name;    ///< of its folder in the farm's
  std::string folder;  ///< absolute
};

/// Job arrays submitted together: task i of every array is a chain of stages of session first + i.
struct SlurmRound {
  std::size_t first = 0;
  std::vector<std::string> jobs;  ///< id of each array; the last is the one that gathers
  std::vector<std::vector<std::string>> stages;  ///< of each array, in their order
};

struct SlurmOptions {
  std::string partition;      ///< empty: the cluster's default
  std::string gpu_partition;  ///< of stages that use a GPU; empty: as the others
  std::string account;
  /// Stages follow each other in one job until it is that long: a job of its own costs a stage a
  /// second of an idle node (docs/scaling.md), 3 % of half a minute.
  double least_job_s = 30;
  Status validate() const;
};

/// farm.json: what the farm does; how far it is lies in the sessions' outcomes.
struct FarmPlan {
  std::string program;               ///< this program, as every node finds it
  std::vector<std::string> options;  ///< given to every run: --config, --set, --seed
  std::vector<FarmSession> sessions;
  std::vector<std::string> stages;  ///< in order; a session's folder admits one run at a time
  std::map<std::string, StageNeeds> needs;
  /// Starts of a stage that is interrupted, over all rounds: by a lost node, memory, time. On this
  /// machine one that is out of time is not started again before the next `resume`.
  int tries = 3;
  bool on_slurm = false;
  SlurmOptions slurm;
  std::vector<SlurmRound> rounds;

  StageNeeds needs_of(const std::string& stage) const;
};

/// The folder's name names the session; usage error when two are called the same, or like a file of
/// the farm. Input error naming a folder that isn't there.
Result<std::vector<FarmSession>> name_sessions(const std::vector<std::string>& folders);

Result<FarmPlan> read_plan(const std::filesystem::path& out);
Status write_plan(const std::filesystem::path& out, const FarmPlan& plan);

}  // namespace orbitfuse::farm
