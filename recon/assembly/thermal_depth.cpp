// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/thermal_depth.hpp"

#include "recon/depth/dense_depth.hpp"
#include "recon/nerf/training_views.hpp"

namespace orbitfuse {

Result<ThermalDepth> add_thermal_depth(nerf::Dataset& data, int width_px, int holdout_every,
                                       std::uint64_t seed, const Progress& progress) {
  const std::vector<bool> left_out = nerf::left_out_views(data, holdout_every);
  const nerf::ValueSpan span = nerf::estimate_span(nerf::training_part(data, left_out));
  const double per_level = (span.high - span.low) / 255;
  Reconstruction model;
  std::vector<cv::Mat> images;
  std::vector<int> index;
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    if (left_out[i]) continue;
    const nerf::TrainingView& view = data.views[i];
    cv::Mat levels;
    view.image.convertTo(levels, CV_8U, 1 / per_level, -span.low / per_level);
    images.push_back(levels);
    model.views.push_back({view.name, view.camera, view.cam_from_world});
    index.push_back(static_cast<int>(i));
  }
  depth::DepthOptions options;
  options.ground = false;  // the sky's gray levels may be the ground's
  options.width_px = width_px;
  options.seed = seed;
  auto found = depth::dense_depth(model, images, options, progress);
  if (!found && found.error().kind != ErrorKind::cancelled)
    return ThermalDepth{0, found.error().message()};
  if (!found) return tl::unexpected(found.error());
  for (DepthMap& map : found->maps) {
    map.view = index[static_cast<std::size_t>(map.view)];
    data.depth.push_back(std::move(map));
  }
  return ThermalDepth{found->report.known, {}};
}

}  // namespace orbitfuse
