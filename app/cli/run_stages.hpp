// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/cli/verb.hpp"

namespace orbitfuse::cli {

/// Positional and option of every verb that runs stages.
struct StageFolders {
  std::string session;  ///< a session, or the --out folder of an earlier run
  std::string out = "out";
};

void add_folders(CLI::App& app, StageFolders& folders);

/// The session and the out folder meant; an out folder knows its session (run.json).
Status resolve(StageFolders& folders);

/// The --out folder of an earlier run brings that run's options; returns its seed, or none when
/// `folder` is no such folder.
Result<std::optional<std::uint64_t>> read_earlier_options(const std::string& folder,
                                                          config::Settings& settings);

/// What the targets read that is missing or out of date.
enum class Missing {
  run,       ///< is made
  leave_out  ///< stays away: the targets work with what is there
};

/// Runs the targets and all they read, says how each stage fared, and fills the --json result.
/// Empty targets: every stage.
Status run_stages(Context& context, const StageFolders& folders,
                  const std::vector<std::string>& targets, Missing missing = Missing::run);

/// The same for a run whose time is planned. Without a budget it is that of the run whose folder is
/// given; if that had none either, stages do what their options say.
Status run_planned(Context& context, const StageFolders& folders,
                   const std::vector<std::string>& targets, std::optional<double> budget_s);

}  // namespace orbitfuse::cli
