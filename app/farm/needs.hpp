// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/farm/job_outcome.hpp"

namespace orbitfuse::farm {

/// Before anything was measured here (docs/scaling.md has the measurements): a stage that needs
/// more is tried again with more.
std::map<std::string, StageNeeds> default_needs(const std::vector<std::string>& stages, int cores);

/// Raises or lowers memory and time to what finished stages of a farm took, with a margin for
/// larger sessions; stages that finished nowhere keep what they have.
void learn_needs(const std::filesystem::path& out, const FarmPlan& finished,
                 std::map<std::string, StageNeeds>& needs);

/// What this machine can give to stages now.
struct Machine {
  int cores = 1;
  double memory_mb = 0;
};
Machine this_machine();

}  // namespace orbitfuse::farm
