// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <optional>

#include "app/farm/job_outcome.hpp"

namespace orbitfuse::farm {

std::string host_name();

/// One stage of one session as a process of its own, `orbitfuse run SESSION --stage STAGE
/// --resume`: what kills it (a bug, the memory) kills neither the farm nor another session. Ends
/// with its maker. Its words are appended to <stage>.log, its events are <stage>.ndjson.
class StageJob {
 public:
  /// Writes the outcome "running" first, so that a node's death is seen as what it is. Device error
  /// when that can't be written.
  static Result<StageJob> start(const FarmPlan& plan, const std::filesystem::path& out,
                                const FarmSession& session, const std::string& stage);
  StageJob(StageJob&& other) noexcept;
  StageJob& operator=(StageJob&& other) noexcept;
  ~StageJob();

  /// The outcome once the process has ended.
  std::optional<JobOutcome> poll();
  /// Asks it to stop, once: it keeps its checkpoint, which a second signal would cost.
  void stop();
  double wall_s() const;

 private:
  StageJob() = default;
  JobOutcome ended(int status, double cpu_s, double memory_mb) const;

  pid_t pid_ = -1;
  bool asked_to_stop_ = false;
  double started_s_ = 0;
  std::string stage_;
  std::filesystem::path events_;
  JobOutcome before_;
};

}  // namespace orbitfuse::farm
