// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/recorded_detail.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "app/pipeline/stage_record.hpp"
#include "app/stages/artifacts.hpp"
#include "app/stages/session_input.hpp"
#include "core/geometry/narrowed.hpp"

namespace orbitfuse::stages {
namespace {

/// What training found of one frame, and its field is without.
struct OwnOfFrame {
  std::array<double, 3> gain = {1, 1, 1};     ///< R, G, B against the common exposure
  double offset_k = 0;                        ///< the camera's drift
  double shading_k = 0;                       ///< the lens', of all frames
  std::optional<nerf::GrayCurve> curve = {};  ///< of a gray thermal frame
};

/// `camera` may be smaller than `recorded`, the frame's own.
Result<cv::Mat> image_of(const std::filesystem::path& file, Samples samples, const Camera& recorded,
                         const Camera& camera, const OwnOfFrame& own) {
  ORBITFUSE_ASSIGN(cv::Mat image, field_image(file, samples));
  if (own.curve) image = nerf::to_common_levels(image, *own.curve);
  if (image.cols != recorded.width || image.rows != recorded.height) return image;  // is told
  if (image.cols != camera.width)
    cv::resize(image, image, {camera.width, camera.height}, 0, 0, cv::INTER_AREA);
  if (samples == Samples::color)
    nerf::even_out(image, Eigen::Array3d(own.gain[0], own.gain[1], own.gain[2]));
  else
    image -= nerf::shading_image(own.shading_k, image.size()) + own.offset_k;
  return image;
}

}  // namespace

Result<nerf::RenderedView> DetailedField::render(const Camera& camera,
                                                 const Rigid3d& cam_from_world,
                                                 const nerf::RenderOptions& options,
                                                 const Progress& progress) {
  ORBITFUSE_ASSIGN(nerf::RenderedView seen,
                   nerf::render(field, camera, cam_from_world, options, progress));
  ORBITFUSE_ASSIGN(const double share, detail.add(field, camera, cam_from_world, seen, progress));
  detailed += share;
  return seen;
}

Result<nerf::PhotoDetail> recorded_detail(const pipeline::StageContext& context,
                                          const Session& session, Modality modality, int width_px,
                                          const nerf::DetailOptions& options,
                                          std::shared_ptr<nerf::KeptRenders> kept) {
  if (options.sources == 0) return nerf::PhotoDetail();
  const std::string of(name(modality));
  const Samples samples = samples_of(session, modality);
  ORBITFUSE_ASSIGN(const Reconstruction model, load_trained_poses(context, modality));
  ORBITFUSE_ASSIGN(const auto doubts, load_doubts(context.of("poses_" + of)));
  ORBITFUSE_ASSIGN(const TrainedFrames trained, load_trained_frames(context.of("train_" + of)));
  std::vector<nerf::DetailSource> sources;
  for (PosedView view : model.views) {
    const std::filesystem::path file = session.folder / view.name;
    std::error_code ignored;
    if (doubts.contains(view.name) || !std::filesystem::exists(file, ignored)) continue;
    const Camera recorded = view.camera;
    view.camera = narrowed_to(recorded, width_px);
    OwnOfFrame own;
    own.shading_k = trained.shading_k;
    if (const auto gain = trained.gains.find(view.name); gain != trained.gains.end())
      own.gain = gain->second;
    if (const auto curve = trained.gray_curves.find(view.name); curve != trained.gray_curves.end())
      own.curve = curve->second;
    if (const auto offset = trained.offsets_k.find(view.name); offset != trained.offsets_k.end())
      own.offset_k = offset->second;
    sources.push_back(
        {view, [=] { return image_of(file, samples, recorded, view.camera, own); }, recorded});
  }
  // What the field learned must not come twice.
  nerf::DetailOptions fitting = options;
  fitting.base_width_px = std::max(options.base_width_px, trained.width_px * 4 / 5);
  return nerf::PhotoDetail::of(std::move(sources), fitting, std::move(kept));
}

Result<nerf::DetailTrial> try_on_recorded(const pipeline::StageContext& context,
                                          DetailedField& shown) {
  ORBITFUSE_ASSIGN(
      const TrainedFrames trained,
      load_trained_frames(context.of("train_" + std::string(name(shown.field.modality())))));
  const std::vector<std::string> all = shown.detail.names();
  std::vector<std::string> names;
  for (const std::string& name : trained.heldout)
    if (std::find(all.begin(), all.end(), name) != all.end()) names.push_back(name);
  if (names.empty()) names = all;
  const std::size_t count = std::min(names.size(), detail_trials);
  for (std::size_t i = 0; i < count; ++i) names[i] = names[i * names.size() / count];  // spread
  names.resize(count);
  return shown.detail.try_on(shown.field, names, context.progress);
}

std::string detail_key(Modality modality) { return std::string(name(modality)) + "_detail"; }

Result<nerf::PhotoDetail> detail_of_new_views(const pipeline::StageContext& context,
                                              const Session& session, Modality modality,
                                              int width_px,
                                              std::shared_ptr<nerf::KeptRenders> kept) {
  if (!context.has("render")) return nerf::PhotoDetail();
  ORBITFUSE_ASSIGN(const pipeline::StageRecord record,
                   pipeline::read_stage_record(context.of("render")));
  const JsonFields metrics = metric_fields(record, context.of("render"));
  const std::string key = detail_key(modality);
  if (!metrics.has(key.c_str())) return nerf::PhotoDetail();  // there was nothing to try
  ORBITFUSE_ASSIGN(const JsonFields told, metrics.child(key.c_str()));
  nerf::DetailOptions options;
  ORBITFUSE_TRY(told.get("sources", options.sources));
  return recorded_detail(context, session, modality, width_px, options, std::move(kept));
}

}  // namespace orbitfuse::stages
