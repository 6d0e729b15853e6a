// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <set>

#include "app/cli/option_pairs.hpp"
#include "app/cli/run_stages.hpp"
#include "app/cli/training_limits.hpp"
#include "app/cli/verb.hpp"
#include "app/stages/build_stages.hpp"
#include "app/stages/given_cameras.hpp"

namespace orbitfuse::cli {
namespace {

/// Whether a run is asked for that ends with some of these stages.
bool ends_among(const std::vector<std::string>& ends, const std::set<std::string>& stages) {
  return !ends.empty() && std::all_of(ends.begin(), ends.end(),
                                      [&](const std::string& end) { return stages.contains(end); });
}

}  // namespace

Action add_run(CLI::App& app) {
  const auto folders = std::make_shared<StageFolders>();
  const auto cameras = std::make_shared<std::string>();
  const auto budget = std::make_shared<std::string>();
  const auto limits = std::make_shared<TrainingLimits>();
  const auto stages_wanted = std::make_shared<std::vector<std::string>>();
  add_folders(app, *folders);
  app.add_option("--cameras", *cameras, "transforms.json with the new views, in the visible frame");
  app.add_option("--budget", *budget,
                 "Time for the whole run, e.g. 90s, 2m, 1m30s: a planner spends it where it pays, "
                 "and says first what it expects")
      ->type_name("DURATION");
  add_target(app, *limits);
  app.add_option("--stage", *stages_wanted,
                 "End with this stage: it and all it reads, no other; repeatable")
      ->type_name("STAGE")
      ->allow_extra_args(false)
      ->check(CLI::IsMember(stages::stage_names()));
  return [folders, cameras, budget, limits, stages_wanted](Context& context) -> Status {
    const bool trains = !ends_among(*stages_wanted, {"poses_visible", "poses_thermal", "depth"});
    const bool renders = !ends_among(
        *stages_wanted,
        {"poses_visible", "poses_thermal", "depth", "train_visible", "train_thermal", "register"});
    ORBITFUSE_TRY(check_apart(
        {{"--target-psnr", limits->target_psnr > 0, "a --stage that trains nothing", !trains},
         {"--cameras", !cameras->empty(), "a --stage that renders nothing", !renders}}));
    std::optional<double> budget_s;
    if (!budget->empty()) {
      ORBITFUSE_ASSIGN(budget_s, parse_duration(*budget));
    }
    ORBITFUSE_TRY(apply(*limits, {Modality::visible, Modality::thermal}, context.config));
    if (!cameras->empty()) {
      // Read here once, so that a wrong file doesn't cost the hours before it is needed.
      ORBITFUSE_TRY(stages::read_given_cameras(*cameras));
      context.config.render.cameras = *cameras;
    }
    return run_planned(context, *folders, *stages_wanted, budget_s);
  };
}

}  // namespace orbitfuse::cli
