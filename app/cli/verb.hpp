// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "app/stages/run_config.hpp"
#include "app/terminal/console.hpp"
#include "core/progress.hpp"
#include "core/result.hpp"

namespace orbitfuse::cli {

/// Options that mean the same to every verb that offers them.
struct CommonOptions {
  std::string config_file;
  std::vector<std::string> overrides;  ///< --set key=value
  bool json = false, quiet = false, print_config = false;
  int verbosity = 0;
  int threads = 0;
  std::uint64_t seed = 1;
  std::string device = "cpu";
  std::string trace_file;  ///< empty: no trace
  bool force = false, resume = false, dry_run = false;
};

/// What a verb's action works with.
struct Context {
  const CommonOptions& common;
  stages::RunConfig& config;
  terminal::Console& console;
  Progress progress;
  std::set<std::string> given;  ///< keys of `config` that the user gave with this call
  nlohmann::json result = nlohmann::json::object();  ///< body of the last --json line
};

using Action = std::function<Status(Context&)>;

/// Common options that only some verbs have a use for. The others don't offer them: what is taken
/// and then passed over would be believed to have worked.
struct CommonUse {
  bool config = false;  ///< --config, --set, --print-config
  bool seed = false, force = false, resume = false;
  bool fields = false;  ///< trains or renders, or tells whether it could, where --device says
};

/// Why a verb doesn't offer a common option, where more can be said than that it means nothing.
struct Unoffered {
  const char* option;
  const char* why;
  const char* remedy;
};

/// A verb adds its own options to its sub-command and returns what to do when it was chosen.
struct Verb {
  const char* name;
  const char* summary;
  const char* example;  ///< shown first in the help; runs as written
  Action (*add)(CLI::App& app);
  CommonUse common;
  std::vector<Unoffered> unoffered = {};
};

/// All verbs, in the order of the help.
const std::vector<Verb>& verbs();

// One file a verb in app/verbs/.
Action add_run(CLI::App& app);
Action add_import(CLI::App& app);
Action add_inspect(CLI::App& app);
Action add_poses(CLI::App& app);
Action add_train(CLI::App& app);
Action add_register(CLI::App& app);
Action add_render(CLI::App& app);
Action add_fuse(CLI::App& app);
Action add_metrics(CLI::App& app);
Action add_report(CLI::App& app);
Action add_measure(CLI::App& app);
Action add_export(CLI::App& app);
Action add_compare(CLI::App& app);
Action add_eval(CLI::App& app);
Action add_view(CLI::App& app);
Action add_replay(CLI::App& app);
Action add_capture(CLI::App& app);
Action add_devices(CLI::App& app);
Action add_mat(CLI::App& app);
Action add_doctor(CLI::App& app);
Action add_farm(CLI::App& app);

}  // namespace orbitfuse::cli
