// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "app/stages/artifacts.hpp"
#include "app/stages/registration_json.hpp"
#include "app/stages/rendered_views.hpp"
#include "app/stages/stage_list.hpp"
#include "core/ply.hpp"
#include "recon/registration/register.hpp"

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

Result<PointCloud> cloud_of(const StageContext& context, const char* stage) {
  const auto file = context.of(stage) / cloud_file;
  if (!std::filesystem::exists(file))
    return fail(ErrorKind::quality, stage, "its field gave no point cloud", "train longer, or record more views");
  return read_ply(file);
}

/// Two frames of their own: the clouds tell how they relate.
Result<StageOutput> register_by_clouds(const StageContext& context, std::uint64_t seed) {
  ORBITFUSE_ASSIGN(const PointCloud thermal, cloud_of(context, "train_thermal"));
  ORBITFUSE_ASSIGN(const PointCloud visible, cloud_of(context, "train_visible"));
  RegistrationOptions options;
  options.seed = static_cast<std::uint32_t>(seed);
  ORBITFUSE_ASSIGN(const RegistrationReport report, register_clouds(thermal, visible, options, context.progress));
  ORBITFUSE_TRY(save_registration(context, report.target_from_source, "point clouds"));
  StageOutput output;
  output.skips = report.skips;
  if (report.ambiguous) output.warnings.push_back("the registration is ambiguous: " + report.ambiguity);
  output.metrics = to_json(report);
  output.metrics["brief"] = report.brief();
  output.metrics["note"] = "The thermal cloud was brought onto the visible one (visible_from_thermal).";
  output.metrics["facts"] = facts(report);
  return output;
}

Result<StageOutput> register_fields(const StageContext& context, std::uint64_t seed) {
  ORBITFUSE_ASSIGN(const json poses, read_json(context.of("poses_thermal") / "poses.json"));
  if (!poses.value("shared_frame", false)) return register_by_clouds(context, seed);
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
  stage.run = [in](const StageContext& context) { return register_fields(context, in.config->seed); };
  return stage;
}

}  // namespace orbitfuse::stages
