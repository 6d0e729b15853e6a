// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/recorded_detail.hpp"

#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "app/pipeline/stage_record.hpp"
#include "app/stages/artifacts.hpp"

namespace orbitfuse::stages {
namespace {

/// What training found of one frame alone.
struct OwnOfFrame {
  std::array<double, 3> gain = {1, 1, 1};  ///< R, G, B against the common exposure
  double offset_k = 0;                     ///< the camera's drift
};

/// `camera` may be smaller than `recorded`, the frame's own.
Result<cv::Mat> image_of(const std::filesystem::path& file, Samples samples, const Camera& recorded,
                         const Camera& camera, const OwnOfFrame& own) {
  ORBITFUSE_ASSIGN(cv::Mat image, field_image(file, samples));
  if (image.cols != recorded.width || image.rows != recorded.height) return image;  // is told
  if (image.cols != camera.width)
    cv::resize(image, image, {camera.width, camera.height}, 0, 0, cv::INTER_AREA);
  if (samples == Samples::color)
    nerf::even_out(image, Eigen::Array3d(own.gain[0], own.gain[1], own.gain[2]));
  else
    image -= own.offset_k;
  return image;
}

}  // namespace

Result<nerf::RenderedView> DetailedField::render(const Camera& camera,
                                                 const Rigid3d& cam_from_world,
                                                 const nerf::RenderOptions& options,
                                                 const Progress& progress,
                                                 const std::string& except) {
  ORBITFUSE_ASSIGN(nerf::RenderedView seen,
                   nerf::render(field, camera, cam_from_world, options, progress));
  ORBITFUSE_ASSIGN(const double share,
                   detail.add(field, camera, cam_from_world, seen, progress, except));
  detailed += share;
  return seen;
}

Result<nerf::PhotoDetail> recorded_detail(const pipeline::StageContext& context,
                                          const Session& session, Modality modality,
                                          Samples samples, int width_px,
                                          const nerf::DetailOptions& options) {
  if (options.sources == 0) return nerf::PhotoDetail();
  const std::string of(name(modality));
  ORBITFUSE_ASSIGN(const Reconstruction model, load_trained_poses(context, modality));
  ORBITFUSE_ASSIGN(const auto doubts, load_doubts(context.of("poses_" + of)));
  ORBITFUSE_ASSIGN(const pipeline::StageRecord trained,
                   pipeline::read_stage_record(context.of("train_" + of)));
  const nlohmann::json& told = trained.output.metrics;
  const auto gains = told.value("image_gains", nlohmann::json::object());
  const auto offsets = told.value("image_offsets_k", nlohmann::json::object());
  std::vector<nerf::DetailSource> sources;
  for (PosedView view : model.views) {
    const std::filesystem::path file = session.folder / view.name;
    std::error_code ignored;
    if (doubts.contains(view.name) || !std::filesystem::exists(file, ignored)) continue;
    const Camera recorded = view.camera;
    if (recorded.width > width_px) {
      const double height = static_cast<double>(width_px) * recorded.height / recorded.width;
      view.camera =
          recorded.scaled_to(width_px, std::max(1, static_cast<int>(std::lround(height))));
    }
    OwnOfFrame own;
    own.gain = gains.value(view.name, own.gain);
    if (offsets.is_object()) own.offset_k = offsets.value(view.name, 0.0);  // an array, once
    sources.push_back({view, [=] { return image_of(file, samples, recorded, view.camera, own); }});
  }
  // What the field learned must not come twice.
  nerf::DetailOptions fitting = options;
  fitting.base_width_px = std::max(options.base_width_px, told.value("width_px", 0) * 4 / 5);
  return nerf::PhotoDetail::of(std::move(sources), fitting);
}

Result<nerf::DetailTrial> try_on_recorded(const pipeline::StageContext& context,
                                          DetailedField& shown) {
  ORBITFUSE_ASSIGN(const pipeline::StageRecord trained,
                   pipeline::read_stage_record(
                       context.of("train_" + std::string(name(shown.field.modality())))));
  auto names = trained.output.metrics.value("heldout", std::vector<std::string>());
  std::erase_if(names, [&](const std::string& n) { return !shown.detail.has(n); });
  if (names.empty()) names = shown.detail.spread_names(detail_trials);
  for (std::size_t i = 0; i < detail_trials && names.size() > detail_trials; ++i)
    names[i] = names[i * names.size() / detail_trials];
  names.resize(std::min(names.size(), detail_trials));
  return shown.detail.try_on(shown.field, names, context.progress);
}

std::string detail_key(Modality modality) { return std::string(name(modality)) + "_detail"; }

Result<nerf::DetailOptions> detail_of_new_views(const pipeline::StageContext& context,
                                                Modality modality) {
  nerf::DetailOptions options;
  options.sources = 0;
  if (!context.has("render")) return options;
  ORBITFUSE_ASSIGN(const pipeline::StageRecord record,
                   pipeline::read_stage_record(context.of("render")));
  const auto& told = record.output.metrics;
  if (const auto found = told.find(detail_key(modality)); found != told.end())
    options.sources = found->value("sources", 0);
  return options;
}

}  // namespace orbitfuse::stages
