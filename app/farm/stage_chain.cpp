// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/stage_chain.hpp"

#include <algorithm>

namespace orbitfuse::farm {
namespace {

void append(StageChain& chain, const StageChain& more) {
  chain.stages.insert(chain.stages.end(), more.stages.begin(), more.stages.end());
  chain.needs.cores = std::max(chain.needs.cores, more.needs.cores);
  chain.needs.memory_mb = std::max(chain.needs.memory_mb, more.needs.memory_mb);
  chain.needs.time_min += more.needs.time_min;
  if (chain.needs.usual_s && more.needs.usual_s)
    *chain.needs.usual_s += *more.needs.usual_s;
  else
    chain.needs.usual_s.reset();
}

/// What nobody has timed counts as long.
bool is_short(const StageChain& chain, double enough_s) {
  return chain.needs.usual_s && *chain.needs.usual_s < enough_s;
}

}  // namespace

std::vector<StageChain> stage_chains(const FarmPlan& plan) {
  const double enough_s = plan.slurm.least_job_s;
  std::vector<StageChain> chains;
  for (const std::string& stage : plan.stages) {
    StageChain next{{stage}, plan.needs_of(stage)};
    if (!chains.empty() && is_short(chains.back(), enough_s) &&
        chains.back().needs.gpu == next.needs.gpu)
      append(chains.back(), next);
    else
      chains.push_back(std::move(next));
  }
  for (std::size_t i = chains.size(); i-- > 1;)
    if (is_short(chains[i], enough_s) && chains[i].needs.gpu == chains[i - 1].needs.gpu) {
      append(chains[i - 1], chains[i]);
      chains.erase(chains.begin() + static_cast<std::ptrdiff_t>(i));
    }
  return chains;
}

}  // namespace orbitfuse::farm
