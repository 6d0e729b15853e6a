// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse::planning {

/// What a planner may choose of a run; the defaults are a run's without a budget.
struct Effort {
  int visible_steps = 4800, thermal_steps = 2400;
  bool detail = true;    ///< recorded views lend new ones detail, as many as the configuration says
  int scored_views = 0;  ///< new views whose fused pictures are measured; 0: all
};

/// The least of each (docs/notes/planner.md); what ends soonest may have a longer visible training.
inline constexpr Effort least_effort{
    .visible_steps = 2400, .thermal_steps = 600, .detail = false, .scored_views = 2};

}  // namespace orbitfuse::planning
