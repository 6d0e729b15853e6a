// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"

namespace orbitfuse::cli {

Action add_run(CLI::App& app) {
  const auto folders = std::make_shared<StageFolders>();
  const auto cameras = std::make_shared<std::string>();
  add_folders(app, *folders);
  app.add_option("--cameras", *cameras, "transforms.json with the new views, in the visible frame");
  return [folders, cameras](Context& context) {
    if (!cameras->empty()) context.config.render.cameras = *cameras;
    return run_stages(context, *folders, {});
  };
}

}  // namespace orbitfuse::cli
