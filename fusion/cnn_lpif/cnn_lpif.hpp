// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/cnn_lpif/network.hpp"
#include "fusion/pyramid/image_pair.hpp"

// CNN-LPIF (Liu, Chen, Cheng, Peng, Wang 2018): a network's weight map and local energies fuse the
// bands of two Laplacian pyramids.
namespace orbitfuse::fusion {

struct CnnLpifOptions {
  /// Band coefficients whose match 2 a b / (a^2 + b^2) over 3x3 is at least this are weighted by
  /// the network (paper, eq. 8 to 10); below it the energies decide, see fuse_band.
  double match_threshold = 0.8;
  /// Finest bands in which the network also weighs the energies where the sources disagree. A patch
  /// is 16 = 2^4 px: what lies in coarser bands the network has not seen.
  int network_bands = 4;
  /// Times that the images are halved for the network: each makes it four times faster and its
  /// weights coarser. Not below one patch.
  int network_halvings = 0;
  /// Side of the square of coefficients over which those decisions are averaged; odd.
  int vote_px = 7;
  /// Gray levels up to which the sources count as the same; patches that don't differ are not sent
  /// through the network, their weight is 1/2. -1 = off.
  double same_within = 1;
  /// Gray levels between a patch's darkest and brightest pixel up to which it counts as flat:
  /// against a flat patch the other source has all the weight, and the network is not asked. -1 =
  /// off.
  double flat_within = 8;

  Status validate() const;
};

struct CnnLpifReport {
  double patches_skipped = 0;  ///< share of patches that the network was not asked for
  double levels_skipped = 0;   ///< share of the bands that hold nothing in both sources
  bool skipped = false;        ///< the images are identical: returned as they are
};

/// Weight of the thermal image, 0..1: the network's answer, overlapping patches averaged.
Plane thermal_weight(const Plane& visible, const Plane& thermal, const CnnLpifOptions& options,
                     CnnLpifReport& report,
                     const cnn::Parameters& network = cnn::shipped_network());

/// Errors: check_pair's, usage. Same bits for any thread count.
Result<Plane> fuse_cnn_lpif(const Plane& visible, const Plane& thermal,
                            const CnnLpifOptions& options, CnnLpifReport* report = nullptr,
                            const cnn::Parameters& network = cnn::shipped_network());

}  // namespace orbitfuse::fusion
