// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

/// The default method. Details: per band the source with the larger local energy, chosen softly
/// so that the choice never flickers. Base: weighted by how much each source stands out from its
/// surroundings. Every constant is measured in docs/benchmarks/fusion.md.
struct BestOptions {
  int levels = 4;            ///< of the pyramid; fewer where the base would be below 8 px
  double sharpness = 4;      ///< exponent of the energy ratio in the weights; larger: harder choice
  int energy_radius_px = 2;  ///< of the window over which energies are averaged
  double base_sharpness = 1; ///< the same for the base's saliency

  Status validate() const;
};

struct BestReport {
  bool skipped = false;  ///< the images are identical: returned as they are
};

/// Errors: check_pair's, usage. Same bits for any thread count.
Result<Plane> fuse_best(const Plane& visible, const Plane& thermal, const BestOptions& options,
                        BestReport* report = nullptr);

}  // namespace orbitfuse::fusion
