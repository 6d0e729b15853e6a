// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/depth/options.hpp"
#include "recon/depth/stereo/patch_cost.hpp"

namespace orbitfuse::depth {

/// A plane and its cost for every pixel of a view.
struct PlaneMap {
  int width = 0, height = 0;
  std::vector<Plane> plane;
  std::vector<float> cost;
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
};

struct DepthRange {
  float near = 0.2f, far = 20.0f;  ///< z, in units of the scene radius
};

/// A known depth (sparse point) in pixels of the view.
struct Seed {
  float x = 0, y = 0, depth = 0;
};

/// Random planes, sampled evenly in inverse depth, and planes through the nearest seed.
PlaneMap random_planes(const DepthView& view, DepthRange range, const std::vector<Seed>& seeds,
                       std::uint64_t seed);

/// The planes of the view at half the size.
PlaneMap doubled(const PlaneMap& coarse, const DepthView& fine, DepthRange range);

/// PatchMatch stereo (Bleyer et al. 2011) with red-black propagation (Galliani et al. 2015): each
/// iteration offers a pixel the planes of eight neighbours and three random changes of its own.
/// Deterministic: `seed` and the pixel decide.
void improve(PlaneMap& map, const DepthView& view, const std::vector<SourceView>& sources,
             DepthRange range, int iterations, const DepthOptions& options, std::uint64_t seed);

}  // namespace orbitfuse::depth
