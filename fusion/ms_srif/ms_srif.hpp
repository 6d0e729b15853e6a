// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/ms_srif/batch_omp.hpp"
#include "fusion/pyramid/image_pair.hpp"

// MS-SRIF: Laplacian pyramid whose base is fused by sparse representation (Liu, Liu, Wang 2015, "A
// general framework for image fusion based on multi-scale transform and sparse representation"). A
// patch's activity counts its level, too, a little, and the visible source's more: else a dark sky
// or a plain wall of either source is as likely to be taken as the other.
namespace orbitfuse::fusion {

struct MsSrifOptions {
  int levels = 4;     ///< of the pyramid; fewer where the base would be smaller than a patch
  int stride_px = 2;  ///< between patches of the base
  int max_atoms = 63;
  double residual =
      0.1;  ///< gray levels RMS at which a patch counts as coded; flat patches end here
  /// A patch is coded when this share of its norm is left: textured patches need no finer code to
  /// be compared. 0 = the reference's stop. See docs/notes/fusion.md.
  double relative_residual = 0.03;
  /// No code is sought where one patch, its structure (L1 norm of its DCT) and its level, counts
  /// this many times as much as the other: the codes would agree, and the winner itself is what its
  /// code comes close to. 0 = off.
  double certain_ratio = 1.5;

  Status validate() const;  ///< usage error naming the field
};

struct MsSrifReport {
  int patches = 0, flat_patches = 0;  ///< per source: all, and those whose code has no atom
  int certain_patches = 0;            ///< whose code was not sought
  double atoms_per_patch = 0;         ///< of all patches
  double levels_skipped = 0;          ///< share of the bands that hold nothing in both sources
  bool skipped = false;               ///< the images are identical: returned as they are
};

/// Errors: check_pair's, usage. Same bits for any thread count.
Result<Plane> fuse_ms_srif(const Plane& visible, const Plane& thermal, const MsSrifOptions& options,
                           MsSrifReport* report = nullptr,
                           const Dictionary& dictionary = Dictionary::shipped());

}  // namespace orbitfuse::fusion
