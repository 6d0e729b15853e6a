// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"

namespace orbitfuse::cli {

Action add_train(CLI::App& app) {
  const auto folders = std::make_shared<StageFolders>();
  const auto modality = std::make_shared<std::string>("both");
  add_folders(app, *folders);
  app.add_option("--modality", *modality, "Which field to train")
      ->check(CLI::IsMember({"both", "visible", "thermal"}))->capture_default_str();
  return [folders, modality](Context& context) {
    std::vector<std::string> targets;
    for (const char* name : {"visible", "thermal"})
      if (*modality == "both" || *modality == name)
        targets.push_back(std::string("train_") + name);
    return run_stages(context, *folders, targets);
  };
}

}  // namespace orbitfuse::cli
