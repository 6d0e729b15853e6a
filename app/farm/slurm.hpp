// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/farm/stage_chain.hpp"
#include "core/progress.hpp"

// Slurm by its commands: no library of a version is linked.
namespace orbitfuse::farm {

/// Runs a Slurm command; its output. Errors: unavailable when it is not installed or the controller
/// does not answer, usage when it refuses what was asked (its own words are told).
Result<std::string> slurm_output(const std::vector<std::string>& command, const Progress& progress);

/// Text safe as one word of sh.
std::string shell_word(const std::string& text);

/// The words of sbatch for one chain of stages of `indices` (task ids) of a round; `after`: id of
/// the array before, empty for the first. Task i starts when task i of that array ended well
/// (aftercorr), so a session never waits for another.
std::vector<std::string> array_words(const FarmPlan& plan, const std::filesystem::path& out,
                                     const StageChain& chain, const std::string& indices,
                                     const std::string& after);
/// "0-3,7".
std::string index_list(const std::vector<std::size_t>& indices);

}  // namespace orbitfuse::farm
