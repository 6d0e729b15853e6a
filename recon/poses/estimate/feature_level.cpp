// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/feature_level.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/image/image_io.hpp"

namespace orbitfuse {

Result<FeatureLevel> FeatureLevel::extract(const Session& session,
                                           const std::vector<const FrameRecord*>& frames,
                                           const PoseOptions& options,
                                           const std::filesystem::path& folder,
                                           const Progress& progress, const FeatureKind& kind) {
  ProxyOptions proxies;
  proxies.max_side_px = options.max_image_side_px;
  ColmapOptions engine{options.colmap, options.seed, options.max_features, kind.peak_threshold,
                       kind.affine_shapes};
  FeatureLevel level(session, options);
  level.images_folder_ = folder / "images";
  ORBITFUSE_ASSIGN(level.images_,
                   write_proxies(session, frames, proxies, level.images_folder_, progress));
  ORBITFUSE_ASSIGN(level.project_,
                   ColmapProject::create(folder / "colmap", level.images_folder_, engine));
  ORBITFUSE_ASSIGN(level.counts_, level.project_.extract(session, level.images_, progress));
  return level;
}

Status FeatureLevel::match(const std::vector<ViewPair>& pairs, const Progress& progress) {
  std::vector<ViewPair> fresh;
  for (const ViewPair& pair : pairs)
    if (matched_.insert(pair).second) fresh.push_back(pair);
  if (fresh.empty()) return {};
  ORBITFUSE_ASSIGN(counts_, project_.match(images_, fresh, progress));
  return {};
}

Result<std::vector<cv::Mat>> FeatureLevel::images(const Reconstruction& model) const {
  std::vector<cv::Mat> images;
  for (const PosedView& view : model.views) {
    const auto of_view = std::find_if(images_.begin(), images_.end(), [&](const ProxyImage& image) {
      return image.frame->file == view.name;
    });
    if (of_view == images_.end())
      return fail(ErrorKind::input, view.name, "a view without features",
                  "give a model of the frames that features were found in");
    ORBITFUSE_ASSIGN(const cv::Mat gray, read_image(images_folder_ / of_view->name));
    images.emplace_back();
    gray.convertTo(images.back(), CV_32F);
  }
  return images;
}

std::string FeatureLevel::found() const {
  return fmt::format("{:.0f} features a view, {} of {} pairs verified", counts_.mean_features,
                     counts_.verified_pairs, counts_.matched_pairs);
}

}  // namespace orbitfuse
