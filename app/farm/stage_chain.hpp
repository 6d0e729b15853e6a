// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/farm/plan.hpp"

namespace orbitfuse::farm {

/// Consecutive stages that one Slurm job runs, and what the job asks for: the most cores and memory
/// of any, the time of all.
struct StageChain {
  std::vector<std::string> stages;
  StageNeeds needs;
};

/// All stages of the plan, in order. A chain goes on until it is least_job_s long as a rule; a
/// stage of unknown length counts as long, a short rest joins what is before it, and a chain never
/// mixes stages for a GPU with others.
std::vector<StageChain> stage_chains(const FarmPlan& plan);

}  // namespace orbitfuse::farm
