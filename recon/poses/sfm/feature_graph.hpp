// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"
#include "core/result.hpp"
#include "core/session/session.hpp"
#include "recon/poses/sfm/descriptor_matching.hpp"
#include "recon/poses/sfm/pair_selection.hpp"
#include "recon/poses/sfm/proxy_images.hpp"

namespace orbitfuse {

using PairMatches = std::map<ViewPair, std::vector<FeatureMatch>>;

/// What the images of one modality say before anything is posed. Frames go by their index.
struct FeatureGraph {
  std::vector<const FrameRecord*> frames;
  std::vector<Camera> cameras;           ///< the lens as known before, at the recorded size
  std::vector<Eigen::Matrix2Xd> pixels;  ///< features, a column each, in recorded pixels
  std::vector<Descriptors> descriptors;
  PairMatches proposed;  ///< by descriptors alone
  PairMatches verified;  ///< held by one two-view geometry
  /// Recorded pixels per pixel that features were found in: errors scale with it.
  double pixel_scale = 1;

  int count() const { return static_cast<int>(frames.size()); }
  /// Features as directions, z = 1, without distortion.
  Eigen::Matrix3Xd rays(int frame, const Camera& camera) const;
};

/// From COLMAP's database of the proxies.
Result<FeatureGraph> read_feature_graph(const std::filesystem::path& database,
                                        const Session& session,
                                        const std::vector<ProxyImage>& images);

/// Frame -> where it stands, for those that have a pose.
using FramePoses = std::vector<std::optional<Rigid3d>>;

}  // namespace orbitfuse
