// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace orbitfuse {

/// How a program ended.
struct Outcome {
  int code = -1;
  std::string out, err;
  bool signalled = false;  ///< by interrupt_after, while it ran
  /// The last line of --json output.
  nlohmann::json result() const;
  /// Every line of --json output.
  std::vector<nlohmann::json> events() const;
};

struct RunOptions {
  std::vector<std::string> environment = {};  ///< "NAME=value", on top of the present one
  std::filesystem::path folder = ".";
  /// Sends the signal once this text has appeared on stderr or stdout; empty = never.
  std::string interrupt_after = {};
  int signal = SIGINT;
  int signals = 1;  ///< at once, as a terminal that goes away sends two
};

/// Runs the built `orbitfuse` with the arguments.
Outcome orbitfuse_program(const std::vector<std::string>& arguments,
                          const RunOptions& options = {});
/// Any program on PATH.
Outcome run_program(const std::vector<std::string>& command, const RunOptions& options = {});

}  // namespace orbitfuse
