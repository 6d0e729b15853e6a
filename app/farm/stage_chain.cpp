// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/stage_chain.hpp"

#include <algorithm>
#include <limits>

namespace orbitfuse::farm {
namespace {

void append(StageChain& chain, const StageChain& more) {
  chain.stages.insert(chain.stages.end(), more.stages.begin(), more.stages.end());
  chain.needs.cores = std::max(chain.needs.cores, more.needs.cores);
  chain.needs.memory_mb = std::max(chain.needs.memory_mb, more.needs.memory_mb);
  chain.needs.time_min += more.needs.time_min;
  chain.needs.usual_s += more.needs.usual_s;
}

}  // namespace

std::vector<StageChain> stage_chains(const FarmPlan& plan) {
  const double enough_s = plan.slurm.least_job_s;
  std::vector<StageChain> chains;
  for (const std::string& stage : plan.stages) {
    StageChain next{{stage}, plan.needs_of(stage)};
    if (!(next.needs.usual_s > 0)) next.needs.usual_s = std::numeric_limits<double>::infinity();
    if (!chains.empty() && chains.back().needs.usual_s < enough_s &&
        chains.back().needs.gpu == next.needs.gpu)
      append(chains.back(), next);
    else
      chains.push_back(std::move(next));
  }
  for (std::size_t i = chains.size(); i-- > 1;)
    if (chains[i].needs.usual_s < enough_s && chains[i].needs.gpu == chains[i - 1].needs.gpu) {
      append(chains[i - 1], chains[i]);
      chains.erase(chains.begin() + static_cast<std::ptrdiff_t>(i));
    }
  return chains;
}

}  // namespace orbitfuse::farm
