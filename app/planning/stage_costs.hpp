// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "app/planning/effort.hpp"
#include "app/planning/scene_facts.hpp"

namespace orbitfuse::planning {

/// Wall seconds of a stage on the machine the figures were measured on (docs/notes/planner.md);
/// 0 where the data give it nothing to do. Training included. `stage`: one of stage_names().
double stage_s(const std::string& stage, const SceneFacts& facts, const Effort& effort);

/// Of these, what training steps take.
double visible_step_s();
double thermal_step_s();

}  // namespace orbitfuse::planning
