// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "core/progress.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "recon/poses/sfm/colmap.hpp"
#include "recon/poses/sfm/feature_graph.hpp"

namespace orbitfuse {

/// Of what kind features are.
struct FeatureKind {
  double peak_threshold = ColmapOptions{}.peak_threshold;
  bool affine_shapes = false;
};

/// Features of some frames at one size, and the pairs matched so far. Errors of all: unavailable
/// (no COLMAP), input (a photo), quality (nothing to match), cancelled.
class FeatureLevel {
 public:
  static Result<FeatureLevel> extract(const Session& session,
                                      const std::vector<const FrameRecord*>& frames,
                                      const PoseOptions& options,
                                      const std::filesystem::path& folder, const Progress& progress,
                                      const FeatureKind& kind = {});

  /// Those of `pairs` that were not matched before.
  Status match(const std::vector<ViewPair>& pairs, const Progress& progress);
  Result<Reconstruction> map(const MapperSettings& settings, const Progress& progress) {
    return project_.map(*session_, images_, settings, progress);
  }
  Result<FeatureGraph> graph() const {
    return read_feature_graph(project_.database(), *session_, images_);
  }

  /// What features were found in, of a model's views: CV_32FC1, 0 to 255.
  Result<std::vector<cv::Mat>> images(const Reconstruction& model) const;

  const PoseOptions& options() const { return options_; }
  std::string found() const;  ///< figures, in words
  int pairs() const { return static_cast<int>(matched_.size()); }

 private:
  FeatureLevel(const Session& session, const PoseOptions& options)
      : session_(&session), options_(options) {}

  const Session* session_;
  PoseOptions options_;
  std::filesystem::path images_folder_;
  std::vector<ProxyImage> images_;
  ColmapProject project_;
  DatabaseCounts counts_;
  std::set<ViewPair> matched_;
};

}  // namespace orbitfuse
