// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

#include "app/view/finished_run.hpp"

namespace orbitfuse::view {

/// What the page is told once: which fields there are, the recorded cameras, scales, palettes.
nlohmann::json scene_json(const FinishedRun& run);

/// The finest stored scale that holds the surface's temperatures.
double surface_kelvin_per_count(const FinishedRun& run);

}  // namespace orbitfuse::view
