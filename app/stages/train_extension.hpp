// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/pipeline/stage.hpp"
#include "recon/nerf/nerf.hpp"

// A longer training goes on from the shorter one's result. That costs no disk space: the field file
// has the optimiser's state, and what else is needed is in curve.json and stage.json.
namespace orbitfuse::stages {

nlohmann::json curve_json(const nerf::TrainReport& report);

/// What stage.json keeps of a report, for readers and for extensions.
nlohmann::json metrics_json(const nerf::TrainReport& report);

/// Writes `checkpoint` from the stage's last result if `options` (the stage's, resolved) ask for
/// the same training, only longer: at least its iterations, and a budget_s (0: none) that it has
/// not used up. Returns the steps done so far; 0: start from nothing.
Result<int> extend_training(const pipeline::StageContext& context, const nlohmann::json& options,
                            const std::filesystem::path& checkpoint);

}  // namespace orbitfuse::stages
