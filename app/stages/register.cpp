// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "app/stages/artifacts.hpp"
#include "app/stages/registration_json.hpp"
#include "app/stages/stage_list.hpp"
#include "core/formats/ply.hpp"
#include "core/geometry/geometry_json.hpp"
#include "recon/assembly/field_renderer.hpp"
#include "recon/assembly/register_fields.hpp"
#include "recon/assembly/training_data.hpp"

namespace orbitfuse::stages {
namespace {
using nlohmann::json;
using pipeline::StageContext;
using pipeline::StageOutput;

Result<PointCloud> cloud_of(const StageContext& context, const char* stage) {
  const auto file = context.of(stage) / cloud_file;
  if (!std::filesystem::exists(file))
    return fail(ErrorKind::quality, stage, "its field gave no point cloud",
                "train longer, or record more views");
  return read_ply(file);
}

Result<ThermalEvidence> thermal_evidence(const StageContext& context, const SessionInput& input) {
  ThermalEvidence thermal;
  ORBITFUSE_ASSIGN(thermal.cloud, cloud_of(context, "train_thermal"));
  ORBITFUSE_ASSIGN(Reconstruction posed, load_trained_poses(context, Modality::thermal));
  for (PosedView& view : posed.views) {
    ORBITFUSE_ASSIGN(cv::Mat image, field_image(input.session.folder / view.name,
                                                input.samples(Modality::thermal)));
    ORBITFUSE_TRY(straighten(image, view));
    thermal.images.push_back(std::move(image));
  }
  thermal.views = std::move(posed.views);
  return thermal;
}

json image_figures(const SimilarityRefinement& r) {
  return {{"kept", r.improved},
          {"unseen", r.unseen},
          {"starts", r.starts},
          {"agreement_before", r.agreement_before},
          {"agreement_after", r.agreement_after},
          {"patches_before", r.matches_before},
          {"patches_after", r.matches_after},
          {"visible_from_thermal", similarity_json(r.visible_from_thermal)}};
}

const char* image_outcome(const SimilarityRefinement& r) {
  if (r.improved) return "kept";
  return r.unseen ? "not possible, they show too little; the clouds' answer stays"
                  : "refused, the clouds' answer stays";
}

std::string unseen_words(const SimilarityRefinement& r) {
  return fmt::format(
      "the thermal images show nothing that tells whether the registration is right ({} patches of "
      "the visible scene in place, agreement of edges {:.3f}): look at the fused views, and where "
      "edges lie apart there, record thermal views that show more of the object's edges",
      r.improved ? r.matches_after : r.matches_before,
      r.improved ? r.agreement_after : r.agreement_before);
}

StageOutput describe(const FieldRegistration& found) {
  const RegistrationReport& clouds = found.clouds;
  const SimilarityRefinement& images = found.images;
  StageOutput output;
  output.skips = clouds.skips;
  output.skips.insert(output.skips.end(), images.skips.begin(), images.skips.end());
  if (clouds.ambiguous)
    output.warnings.push_back("the registration is ambiguous: " + clouds.ambiguity);
  if (images.unseen) output.warnings.push_back(unseen_words(images));
  output.metrics = to_json(clouds);
  output.metrics["brief"] =
      clouds.brief() + (images.improved ? ", refined by the thermal images" : "");
  output.metrics["image_refinement"] = image_figures(images);
  output.metrics["note"] =
      "The thermal cloud was brought onto the visible one (visible_from_thermal).";
  RegistrationReport shown = clouds;
  shown.target_from_source = found.visible_from_thermal();
  output.metrics["facts"] = facts(shown);
  output.metrics["facts"].push_back(json::array(
      {"refined by the thermal images",
       fmt::format("{}: agreement of edges {:.3f} before, {:.3f} after, the best of {} starts",
                   image_outcome(images), images.agreement_before, images.agreement_after,
                   images.starts)}));
  return output;
}

/// Two frames of their own.
Result<StageOutput> relate_frames(const StageContext& context, const SessionInput& input,
                                  std::uint64_t seed) {
  ORBITFUSE_ASSIGN(const ThermalEvidence thermal, thermal_evidence(context, input));
  ORBITFUSE_ASSIGN(PointCloud cloud, cloud_of(context, "train_visible"));
  ORBITFUSE_ASSIGN(const nerf::Field field,
                   nerf::Field::load(context.of("train_visible") / field_file));
  const VisibleEvidence visible{std::move(cloud), edge_renderer(field, context.progress)};
  RegistrationOptions options;
  options.seed = static_cast<std::uint32_t>(seed);
  ORBITFUSE_ASSIGN(const FieldRegistration found,
                   register_fields(thermal, visible, options, context.progress));
  ORBITFUSE_TRY(save_registration(
      context.folder,
      {found.visible_from_thermal(),
       found.images.improved ? "point clouds, then edges of the thermal images" : "point clouds"}));
  return describe(found);
}

Result<StageOutput> run_register(const StageContext& context, const SessionInput& input,
                                 std::uint64_t seed) {
  ORBITFUSE_ASSIGN(const PoseFrame frame, load_pose_frame(context.of("poses_thermal")));
  if (frame == PoseFrame::own) return relate_frames(context, input, seed);
  ORBITFUSE_TRY(save_registration(context.folder, {{}, "shared frame"}));
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
  stage.version = 4;  // sees straight thermal images, and counts shifts
  stage.needs = {"poses_visible", "poses_thermal", "train_visible", "train_thermal"};
  stage.options = {{"seed", in.config->seed}};
  stage.run = [in](const StageContext& context) {
    return run_register(context, *in.session, in.config->seed);
  };
  return stage;
}

}  // namespace orbitfuse::stages
