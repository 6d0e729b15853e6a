// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/pipeline/stage.hpp"
#include "app/stages/run_config.hpp"
#include "app/stages/session_input.hpp"
#include "recon/nerf/kept_renders.hpp"

namespace orbitfuse::stages {

/// The whole road, each stage after all it reads. `kept`: what its stages share of their renders;
/// where a run's stages are made several times, the same for all. Null: one of their own.
std::vector<pipeline::Stage> build_stages(const SessionInput& session, const RunConfig& config,
                                          std::shared_ptr<nerf::KeptRenders> kept = nullptr);
/// Their names, in that order.
const std::vector<std::string>& stage_names();

}  // namespace orbitfuse::stages
