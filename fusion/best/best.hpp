// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

/// The default of FusionOptions::method (fuse/fuse.hpp); the default picture of a run's report is
/// heat's. Details: per band the source with the larger local energy, chosen softly so that the
/// choice never flickers, at a strength that keeps part of its contrast to the level it moves to.
/// Base: by votes of patches on which source holds more, agreed within plain regions, so that no
/// level near an edge is neither source's (a halo); small hot things and small marks of the visible
/// image are kept. See docs/notes/fusion.md for what each constant does to the scores.
struct BestOptions {
  int levels = 4;         ///< of the pyramid; fewer where the base would be below 8 px
  double sharpness = 12;  ///< exponent of the amplitude ratio in the weights; larger: harder choice
  int energy_radius_px = 5;  ///< of the window over which energies are averaged
  /// Share of the way to constant contrast that a detail's strength goes when its level changes.
  double contrast_kept = 0.2;
  /// Gray levels of activity that the visible source has for free in the base: where neither source
  /// holds structure people expect the visible level (a bright sky, not a cold one).
  double visible_preference = 2;
  /// Share of a patch's mean that counts as activity: lamps, and hot bodies in a white-hot thermal
  /// image, are bright without structure. 0 for black-hot images.
  double brightness_weight = 0.02;

  Status validate() const;
};

struct BestReport {
  double levels_skipped = 0;  ///< share of the pyramid's bands that hold nothing in both sources
  bool skipped = false;       ///< the images are identical: returned as they are
};

/// Errors: check_pair's, usage. Same bits for any thread count.
Result<Plane> fuse_best(const Plane& visible, const Plane& thermal, const BestOptions& options,
                        BestReport* report = nullptr);

}  // namespace orbitfuse::fusion
