// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/run_stages.hpp"
#include "app/cli/training_limits.hpp"
#include "app/cli/verb.hpp"
#include "app/stages/build_stages.hpp"
#include "core/formats/transforms_json.hpp"

namespace orbitfuse::cli {

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
    std::optional<double> budget_s;
    if (!budget->empty()) {
      ORBITFUSE_ASSIGN(budget_s, parse_duration(*budget));
    }
    ORBITFUSE_TRY(apply(*limits, {Modality::visible, Modality::thermal}, context.config));
    if (!cameras->empty()) {
      // Read here once, so that a wrong file doesn't cost the hours before it is needed.
      ORBITFUSE_TRY(read_transforms_json(*cameras));
      context.config.render.cameras = *cameras;
    }
    return run_planned(context, *folders, *stages_wanted, budget_s);
  };
}

}  // namespace orbitfuse::cli
