// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/run_stages.hpp"
#include "app/cli/training_limits.hpp"
#include "app/cli/verb.hpp"
#include "core/formats/transforms_json.hpp"

namespace orbitfuse::cli {

Action add_run(CLI::App& app) {
  const auto folders = std::make_shared<StageFolders>();
  const auto cameras = std::make_shared<std::string>();
  const auto limits = std::make_shared<TrainingLimits>();
  add_folders(app, *folders);
  app.add_option("--cameras", *cameras, "transforms.json with the new views, in the visible frame");
  add_limits(app, *limits);
  return [folders, cameras, limits](Context& context) -> Status {
    ORBITFUSE_TRY(apply(*limits, {Modality::visible, Modality::thermal}, context.config));
    if (!cameras->empty()) {
      // Read here once, so that a wrong file doesn't cost the hours before it is needed.
      ORBITFUSE_TRY(read_transforms_json(*cameras));
      context.config.render.cameras = *cameras;
    }
    return run_stages(context, *folders, {});
  };
}

}  // namespace orbitfuse::cli
