// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "app/pipeline/stage.hpp"
#include "app/stages/run_config.hpp"
#include "app/stages/session_input.hpp"

namespace orbitfuse::stages {

/// The whole road, each stage after all it reads.
std::vector<pipeline::Stage> build_stages(const SessionInput& session, const RunConfig& config);
/// Their names, in that order.
const std::vector<std::string>& stage_names();

}  // namespace orbitfuse::stages
