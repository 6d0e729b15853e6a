// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/farm/job_outcome.hpp"

namespace orbitfuse::farm {

/// Before anything was measured here (docs/scaling.md has the measurements): a stage that needs
/// more is tried again with more, and usual_s of 24 + 24 views only says which stages are short.
/// `on_gpu`: the run computes on one, so its training and rendering ask for a node that has it.
std::map<std::string, StageNeeds> default_needs(const std::vector<std::string>& stages, int cores,
                                                bool on_gpu);

/// Raises or lowers memory and time to what finished stages of a farm took, with a margin for
/// larger sessions; stages that finished nowhere keep what they have.
void learn_needs(const std::filesystem::path& out, const FarmPlan& finished,
                 std::map<std::string, StageNeeds>& needs);

/// The same for the farm's own stages, which it only raises: an edit of the plan holds.
void raise_learned(const std::filesystem::path& out, FarmPlan& plan);

/// Raises memory and time of stages that were killed or ran out of time, to twice what they had
/// taken by then: called again without a new start, it changes nothing.
void raise_interrupted(const std::filesystem::path& out, FarmPlan& plan);

/// What this machine can give to stages now.
struct Machine {
  int cores = 1;
  double memory_mb = 0;
};
Machine this_machine();

}  // namespace orbitfuse::farm
