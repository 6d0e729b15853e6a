// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "app/stages/artifacts.hpp"
#include "app/stages/rendered_views.hpp"
#include "app/stages/stage_list.hpp"

namespace orbitfuse::stages {
namespace {
using nlohmann::json;
using pipeline::StageContext;
using pipeline::StageOutput;

Status save_registration(const StageContext& context, const Similarity3d& visible_from_thermal,
                         const std::string& how) {
  return write_json(context.folder / registration_file,
                    {{"schema", 1},
                     {"conventions", "x_visible = scale * R * x_thermal + t"},
                     {"how", how},
                     {"visible_from_thermal", to_json(visible_from_thermal)}});
}

Result<StageOutput> register_fields(const StageContext& context) {
  ORBITFUSE_ASSIGN(const json poses, read_json(context.of("poses_thermal") / "poses.json"));
  if (!poses.value("shared_frame", false))
    return fail(ErrorKind::unavailable, "register",
                "the modalities have frames of their own, and this build can't register fields yet",
                "use a session whose thermal views are localised in the visible frame");
  ORBITFUSE_TRY(save_registration(context, {}, "shared frame"));
  StageOutput output;
  output.skips.push_back({"registration of the two point clouds",
                          "the thermal views were posed in the visible frame",
                          "nothing left to find: the similarity is the identity"});
  output.metrics = {{"brief", "skipped: both modalities share the visible frame"},
                    {"note", "Skipped: the thermal views were posed in the visible frame, so both "
                             "fields already share it (s = 1, R = identity, t = 0)."}};
  return output;
}

}  // namespace

pipeline::Stage register_stage(const StageInputs& in) {
  pipeline::Stage stage;
  stage.name = "register";
  stage.needs = {"poses_visible", "poses_thermal", "train_visible", "train_thermal"};
  stage.options = {{"seed", in.config->seed}};
  stage.run = register_fields;
  return stage;
}

}  // namespace orbitfuse::stages
