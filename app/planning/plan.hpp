// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/planning/error_curves.hpp"
#include "app/planning/stage_costs.hpp"

namespace orbitfuse::planning {

/// What of an effort is settled: by the user, or because its stage is over. Absent: free.
struct Settled {
  std::optional<int> visible_steps = {}, thermal_steps = {}, scored_views = {};
  std::optional<bool> detail = {};
};

/// The choice for the stages still to come.
struct Plan {
  Effort effort;
  double expected_s = 0;  ///< of these stages, on this machine
  bool fits = true;       ///< false: even the least takes longer than there is time
  bool all_used = true;   ///< false: more time would bring nothing the curves know of
};

/// The effort of least expected loss for `stages` within `available_s`; the least one where
/// nothing fits. `slowness`: this machine's seconds for one of stage_s().
Plan make_plan(const SceneFacts& facts, const std::vector<std::string>& stages,
               const Settled& settled, double slowness, double available_s);

}  // namespace orbitfuse::planning
