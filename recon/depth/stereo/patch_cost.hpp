// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "recon/depth/stereo/depth_view.hpp"

namespace orbitfuse::depth {

/// A plane through the surface seen at one pixel.
struct Plane {
  float depth = 1;         ///< z at the pixel
  Eigen::Vector3f normal;  ///< unit, camera axes, towards the camera
};

inline constexpr int patch_samples =
    32;  ///< every other pixel of 9 x 7 is 31; the last has no weight
inline constexpr float worst_cost = 2.0f;

/// The patch round one reference pixel, sampled and weighed once for all hypotheses.
struct ReferencePatch {
  alignas(32) float value[patch_samples];   ///< minus the weighted mean, times its weight
  alignas(32) float weight[patch_samples];  ///< sums to 1
  float variance = 0;
  float x = 0, y = 0;  ///< pixel centre
};

/// Of nearly one brightness (noise apart): every plane costs the same.
bool is_flat(const ReferencePatch& patch);

/// From the reference camera to one source camera.
struct SourceView {
  const std::uint8_t* pixels = nullptr;
  int width = 0, height = 0, stride = 0;
  Eigen::Matrix3f a;  ///< K_s R K_r^-1
  Eigen::Vector3f b;  ///< K_s t
};

SourceView source_view(const DepthView& reference, const DepthView& source);

/// Bilateral weights as in Gipuma and COLMAP: near pixels of like brightness belong together.
ReferencePatch reference_patch(const DepthView& view, int x, int y);

/// 1 - NCC between the reference patch and its image in the source by the plane's homography
/// H = K_s (R + t n^T / (n . X)) K_r^-1, in [0, 2]. `scaled_normal` = K_r^-T n / (n . X): the
/// plane in pixel coordinates.
float patch_cost(const ReferencePatch& patch, const SourceView& source,
                 const Eigen::Vector3f& scaled_normal);

}  // namespace orbitfuse::depth
