// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "app/planning/effort.hpp"
#include "app/planning/scene_facts.hpp"

namespace orbitfuse::planning {

/// Stages in the order of a run.
const std::vector<std::string>& planned_stages();

/// Wall seconds of a stage on the machine the figures were measured on (docs/notes/planner.md);
/// 0 where the data give it nothing to do. Training included.
double stage_s(const std::string& stage, const SceneFacts& facts, const Effort& effort);

/// Of these, what training steps take.
double visible_step_s();
double thermal_step_s();

}  // namespace orbitfuse::planning
