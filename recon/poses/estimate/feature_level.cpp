// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/feature_level.hpp"

#include <fmt/format.h>

namespace orbitfuse {

Result<FeatureLevel> FeatureLevel::extract(const Session& session,
                                           const std::vector<const FrameRecord*>& frames,
                                           const PoseOptions& options,
                                           const std::filesystem::path& folder,
                                           const Progress& progress, double peak_threshold) {
  ProxyOptions proxies;
  proxies.max_side_px = options.max_image_side_px;
  ColmapOptions engine{options.colmap, options.seed, options.max_features, peak_threshold};
  FeatureLevel level(session, options);
  ORBITFUSE_ASSIGN(level.images_,
                   write_proxies(session, frames, proxies, folder / "images", progress));
  ORBITFUSE_ASSIGN(level.project_,
                   ColmapProject::create(folder / "colmap", folder / "images", engine));
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

std::string FeatureLevel::found() const {
  return fmt::format("{:.0f} features a view, {} of {} pairs verified", counts_.mean_features,
                     counts_.verified_pairs, counts_.matched_pairs);
}

}  // namespace orbitfuse
