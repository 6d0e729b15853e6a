// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "app/pipeline/stage.hpp"
#include "app/stages/run_config.hpp"
#include "app/stages/session_input.hpp"

namespace orbitfuse::stages {

/// The whole road, each stage after all it reads.
std::vector<pipeline::Stage> build_stages(const SessionInput& session, const RunConfig& config);

}  // namespace orbitfuse::stages
