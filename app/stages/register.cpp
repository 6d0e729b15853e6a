// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "app/stages/artifacts.hpp"
#include "app/stages/registration_json.hpp"
#include "app/stages/rendered_views.hpp"
#include "app/stages/stage_list.hpp"
#include "app/stages/training_data.hpp"
#include "app/stages/visible_renderer.hpp"
#include "core/formats/ply.hpp"
#include "recon/registration/similarity_search.hpp"
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
    return fail(ErrorKind::quality, stage, "its field gave no point cloud",
                "train longer, or record more views");
  return read_ply(file);
}

/// The thermal images, posed in their own world, and the visible field whose renders must explain
/// them.
struct ImageEvidence {
  Reconstruction thermal;
  std::vector<cv::Mat> images;
  nerf::Field field;
};

Result<ImageEvidence> load_evidence(const StageContext& context, const SessionInput& input) {
  ORBITFUSE_ASSIGN(Reconstruction thermal,
                   load_trained_poses(context, Modality::thermal));
  ORBITFUSE_ASSIGN(nerf::Field field,
                   nerf::Field::load(context.of("train_visible") / field_file));
  std::vector<cv::Mat> images;
  for (const PosedView& view : thermal.views) {
    ORBITFUSE_ASSIGN(cv::Mat image, field_image(input.session.folder / view.name, Modality::thermal,
                                                !input.has_temperatures()));
    images.push_back(std::move(image));
  }
  return ImageEvidence{std::move(thermal), std::move(images), std::move(field)};
}

/// What the clouds leave open, to be searched by the images.
SimilaritySearchOptions left_open(const RegistrationReport& clouds) {
  SimilaritySearchOptions options;
  options.turn_deg = std::clamp(2 * clouds.spread_rotation_deg, options.turn_deg, 15.0);
  options.growth = std::clamp(2 * clouds.spread_scale_percent / 100, options.growth, 0.15);
  options.clouds_decide = !clouds.ambiguous;
  return options;
}

/// Two frames of their own: the clouds tell how they relate.
Result<StageOutput> register_by_clouds(const StageContext& context, const SessionInput& input,
                                       std::uint64_t seed) {
  ORBITFUSE_ASSIGN(const PointCloud thermal, cloud_of(context, "train_thermal"));
  ORBITFUSE_ASSIGN(const PointCloud visible, cloud_of(context, "train_visible"));
  RegistrationOptions options;
  options.seed = static_cast<std::uint32_t>(seed);
  ORBITFUSE_ASSIGN(const ImageEvidence seen, load_evidence(context, input));
  const SceneRenderer renderer = edge_renderer(seen.field, context.progress);
  Status views_failed;
  const ViewScore explained = [&](const Similarity3d& visible_from_thermal) {
    const auto support = similarity_support(renderer, seen.images, seen.thermal.views,
                                            visible_from_thermal, context.progress);
    if (!support) views_failed = tl::unexpected(support.error());
    return support ? *support : 0.0;
  };
  ORBITFUSE_ASSIGN(const RegistrationReport report,
                   register_clouds(thermal, visible, options, context.progress, explained));
  ORBITFUSE_TRY(views_failed);
  ORBITFUSE_ASSIGN(const SimilarityRefinement refined,
                   search_similarity(renderer, seen.images, seen.thermal.views,
                                     report.target_from_source, left_open(report),
                                     context.progress));
  ORBITFUSE_TRY(save_registration(
      context, refined.visible_from_thermal,
      refined.improved ? "point clouds, then edges of the thermal images" : "point clouds"));
  StageOutput output;
  output.skips = report.skips;
  output.skips.insert(output.skips.end(), refined.skips.begin(), refined.skips.end());
  if (report.ambiguous)
    output.warnings.push_back("the registration is ambiguous: " + report.ambiguity);
  output.metrics = to_json(report);
  output.metrics["brief"] =
      report.brief() + (refined.improved ? ", refined by the thermal images" : "");
  output.metrics["image_refinement"] = {
      {"kept", refined.improved},
      {"starts", refined.starts},
      {"agreement_before", refined.agreement_before},
      {"agreement_after", refined.agreement_after},
      {"patches_before", refined.matches_before},
      {"patches_after", refined.matches_after},
      {"visible_from_thermal", to_json(refined.visible_from_thermal)}};
  output.metrics["note"] =
      "The thermal cloud was brought onto the visible one (visible_from_thermal).";
  RegistrationReport shown = report;
  shown.target_from_source = refined.visible_from_thermal;
  output.metrics["facts"] = facts(shown);
  output.metrics["facts"].push_back(json::array(
      {"refined by the thermal images",
       fmt::format("{}: agreement of edges {:.3f} before, {:.3f} after, the best of {} starts",
                   refined.improved ? "kept" : "refused, the clouds' answer stays",
                   refined.agreement_before, refined.agreement_after, refined.starts)}));
  return output;
}

Result<StageOutput> register_fields(const StageContext& context, const SessionInput& input,
                                    std::uint64_t seed) {
  ORBITFUSE_ASSIGN(const json poses, read_json(context.of("poses_thermal") / "poses.json"));
  if (!poses.value("shared_frame", false)) return register_by_clouds(context, input, seed);
  ORBITFUSE_TRY(save_registration(context, {}, "shared frame"));
  StageOutput output;
  output.skips.push_back({"registration of the two point clouds",
                          "the thermal views were posed in the visible frame",
                          "nothing left to find: the similarity is the identity"});
  output.metrics = {{"brief", "skipped: both modalities share the visible frame"},
                    {"note",
                     "Skipped: the thermal views were posed in the visible frame, so both "
                     "fields already share it (s = 1, R = identity, t = 0)."}};
  return output;
}

}  // namespace

pipeline::Stage register_stage(const StageInputs& in) {
  pipeline::Stage stage;
  stage.name = "register";
  stage.version = 2;
  stage.needs = {"poses_visible", "poses_thermal", "train_visible", "train_thermal"};
  stage.options = {{"seed", in.config->seed}};
  stage.run = [in](const StageContext& context) {
    return register_fields(context, *in.session, in.config->seed);
  };
  return stage;
}

}  // namespace orbitfuse::stages
