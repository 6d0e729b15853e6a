// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// Runs a program without a shell, its output appended to `log`, and waits for it; a cancelled
/// Progress kills it. Returns the exit status (128 + signal when it was killed by one).
/// Errors: unavailable when it can't be started, cancelled.
Result<int> run_process(const std::vector<std::string>& command, const std::filesystem::path& log,
                        const std::string& stage, const Progress& progress);

}  // namespace orbitfuse
