// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/recorded_detail.hpp"

#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "app/pipeline/stage_record.hpp"
#include "app/stages/artifacts.hpp"

namespace orbitfuse::stages {
namespace {

using Gain = std::array<double, 3>;  ///< R, G, B against the common exposure

Result<cv::Mat> image_of(const std::filesystem::path& file, Samples samples, const Camera& camera,
                         const Gain& gain) {
  ORBITFUSE_ASSIGN(cv::Mat image, field_image(file, samples));
  if (image.cols > camera.width)
    cv::resize(image, image, {camera.width, camera.height}, 0, 0, cv::INTER_AREA);
  if (samples == Samples::color)
    cv::multiply(image, cv::Scalar(1 / gain[0], 1 / gain[1], 1 / gain[2]), image);
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
  const nlohmann::json gains =
      trained.output.metrics.value("image_gains", nlohmann::json::object());
  std::vector<nerf::DetailSource> sources;
  for (PosedView view : model.views) {
    if (doubts.contains(view.name)) continue;
    Camera& camera = view.camera;
    if (camera.width > width_px) {
      const double height = static_cast<double>(width_px) * camera.height / camera.width;
      camera = camera.scaled_to(width_px, std::max(1, static_cast<int>(std::lround(height))));
    }
    const Gain gain = gains.value(view.name, Gain{1, 1, 1});
    const std::filesystem::path file = session.folder / view.name;
    sources.push_back({view, [=] { return image_of(file, samples, view.camera, gain); }});
  }
  return nerf::PhotoDetail::of(std::move(sources), options);
}

Result<nerf::DetailTrial> try_on_recorded(const pipeline::StageContext& context,
                                          DetailedField& shown) {
  ORBITFUSE_ASSIGN(const pipeline::StageRecord trained,
                   pipeline::read_stage_record(
                       context.of("train_" + std::string(name(shown.field.modality())))));
  auto names = trained.output.metrics.value("heldout", std::vector<std::string>());
  constexpr std::size_t most = 3;  // each takes a render, and its neighbours'
  if (names.empty()) names = shown.detail.spread_names(most);
  for (std::size_t i = 0; i < most && names.size() > most; ++i)
    names[i] = names[i * names.size() / most];
  names.resize(std::min(names.size(), most));
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
