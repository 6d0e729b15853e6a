// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/planning/effort.hpp"
#include "app/planning/scene_facts.hpp"

namespace orbitfuse::planning {

/// Errors of views that didn't train, as a run measures them on its held-out frames.
struct ExpectedErrors {
  double visible_psnr_db = 0;
  double thermal_mae_k = 0;
  /// How far scenes lay from this that had no part in it: seven of eight, three of four.
  double visible_spread_db = 0, thermal_spread_k = 0;
};

/// From measured curves (docs/notes/planner.md): their shape is the scenes' mean, their level
/// the photos' detail.
ExpectedErrors expected_errors(const SceneFacts& facts, const Effort& effort);

/// What a plan makes small: the mean logarithm of the errors of both modalities. A tenth is a
/// tenth of an error.
double loss(const SceneFacts& facts, const Effort& effort);

}  // namespace orbitfuse::planning
