// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/farm/plan.hpp"

namespace orbitfuse::farm {

enum class JobState {
  waiting,      ///< never started
  running,      ///< started; a node that died leaves it so
  done,         ///< the run ended well: the stage stands, or has nothing to do with these data
  failed,       ///< the run said why it can't; trying again gives the same
  interrupted,  ///< killed, out of time or memory, a signal: goes on from its checkpoint
};
std::string_view name(JobState state);

/// How the cause of a stage begins that its time limit stopped.
inline constexpr const char* out_of_time = "out of time";
inline constexpr int exit_killed = 128 + 9;  ///< of a process that SIGKILL ended

/// How a stage of a session fared so far. One file each, with one writer at a time: whoever runs
/// it.
struct JobOutcome {
  JobState state = JobState::waiting;
  std::string cause;  ///< of failed and interrupted
  std::string host;
  std::optional<int> exit_code;                 ///< none: it has not ended
  int starts = 0;                               ///< how often the stage's run was started
  double cpu_s = 0, wall_s = 0, memory_mb = 0;  ///< sums of all starts; memory the largest
};

/// A stage waits when its file is missing; so it does when the file can't be read: the run itself
/// finds out what is done.
JobOutcome read_outcome(const std::filesystem::path& out, const std::string& session,
                        const std::string& stage);
Status write_outcome(const std::filesystem::path& out, const std::string& session,
                     const std::string& stage, const JobOutcome& outcome);
/// The farm's own files of a session: outcomes and logs.
std::filesystem::path records_of(const std::filesystem::path& out, const std::string& session);

/// The first stage of a session that is not done; the number of stages when all are.
std::size_t next_stage(const std::filesystem::path& out, const FarmPlan& plan,
                       const std::string& session);

}  // namespace orbitfuse::farm
