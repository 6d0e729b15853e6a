// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

/// The default method. Details: per band the source with the larger local energy, chosen softly
/// so that the choice never flickers. Base: by a vote on which source varies more, averaged over a
/// wide window. Every constant is measured in docs/benchmarks/fusion.md.
struct BestOptions {
  int levels = 4;            ///< of the pyramid; fewer where the base would be below 8 px
  double sharpness = 8;      ///< exponent of the energy ratio in the weights; larger: harder choice
  int energy_radius_px = 4;  ///< of the window over which energies are averaged
  int base_window = 9;       ///< base pixels over which a source's variance is taken
  int base_vote = 17;        ///< base pixels over which votes are averaged

  Status validate() const;
};

struct BestReport {
  bool skipped = false;  ///< the images are identical: returned as they are
};

/// Errors: check_pair's, usage. Same bits for any thread count.
Result<Plane> fuse_best(const Plane& visible, const Plane& thermal, const BestOptions& options,
                        BestReport* report = nullptr);

}  // namespace orbitfuse::fusion
