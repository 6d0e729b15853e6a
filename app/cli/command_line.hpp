// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "app/cli/verb.hpp"

namespace orbitfuse::cli {

/// The parsed command line: common options, the chosen verb and its action.
struct CommandLine {
  CommandLine();

  CLI::App app;
  CommonOptions common;
  std::vector<std::pair<const Verb*, Action>> actions;

  /// The verb that was parsed; parse() of `app` comes first.
  const std::pair<const Verb*, Action>& chosen() const;
};

/// A readable reason for a command line that CLI11 refused, with a suggestion for slips.
Error usage_error(const CommandLine& line, const CLI::ParseError& error, int argc,
                  const char* const* argv);

}  // namespace orbitfuse::cli
