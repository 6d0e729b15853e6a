// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/farm/job_outcome.hpp"
#include "core/progress.hpp"

namespace orbitfuse::farm {

/// Submits the sessions that are not done as job arrays, one for each chain of stages
/// (stage_chain.hpp), and one job behind them all that gathers. What was submitted is in farm.json;
/// when one is refused the others are withdrawn.
Status submit(const std::filesystem::path& out, FarmPlan& plan, bool failed_too,
              const Progress& progress);

/// Of the farm's jobs, those that Slurm has not ended, besides the one we are: of any user, and
/// also what a submission sent off that died before it could write farm.json.
Result<std::vector<std::string>> queued_jobs(const std::filesystem::path& out, const FarmPlan& plan,
                                             const Progress& progress);

Status cancel(const std::filesystem::path& out, const FarmPlan& plan, const Progress& progress);

/// What a task of an array does: the stages that are not done, in their order, until one fails.
/// Error: that stage's own.
Status run_task(const std::filesystem::path& out, const FarmPlan& plan,
                const std::vector<std::string>& stages, std::size_t session,
                const Progress& progress);

/// Doubles memory or time of stages that Slurm ended for want of it. Where sacct has no database
/// the controller is asked, which forgets jobs after minutes (MinJobAge). What the stages' own
/// records tell is used as well (raise_interrupted).
void raise_needs(const std::filesystem::path& out, FarmPlan& plan, const Progress& progress);

}  // namespace orbitfuse::farm
