// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/run_stages.hpp"
#include "app/cli/training_limits.hpp"
#include "app/cli/verb.hpp"

namespace orbitfuse::cli {

Action add_train(CLI::App& app) {
  const auto folders = std::make_shared<StageFolders>();
  const auto modality = std::make_shared<std::string>("both");
  const auto limits = std::make_shared<TrainingLimits>();
  add_folders(app, *folders);
  app.add_option("--modality", *modality, "Which field to train")
      ->check(CLI::IsMember({"both", "visible", "thermal"}))
      ->capture_default_str();
  add_limits(app, *limits);
  return [folders, modality, limits](Context& context) -> Status {
    std::vector<Modality> fields;
    std::vector<std::string> targets;
    for (const Modality field : {Modality::visible, Modality::thermal})
      if (*modality == "both" || *modality == name(field)) {
        fields.push_back(field);
        targets.push_back("train_" + std::string(name(field)));
      }
    ORBITFUSE_TRY(apply(*limits, fields, context.config));
    return run_stages(context, *folders, targets);
  };
}

}  // namespace orbitfuse::cli
