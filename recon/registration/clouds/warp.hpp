// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/registration/clouds/refine.hpp"
#include "recon/registration/register.hpp"

namespace orbitfuse::registration {

/// Lengths in the target's unit frame (the clouds' radius is 1).
struct WarpOptions {
  double length = 0.5;  ///< over which displacements are alike: shorter ones are shape and noise,
                        ///< longer ones a similarity takes up
  double pair_bound = 0.06;    ///< wider lets floaters near the surface bend the field to them
  double min_gain = 3;         ///< log evidence for a warp over none: 20 to 1, "strong" in Kass and
                               ///< Raftery (1995)
  double max_amplitude = 0.1;  ///< more is another shape, not a warp: WarpOutcome::at_limit
  double min_sigma = 0.002;    ///< data of less noise than that have sampling errors instead, which
                               ///< are no warp
  int rounds = 8;              ///< of pairing and solving, at most; the updates settle in 4 to 8
};

struct Unwarped {
  Similarity3d target_from_source;  ///< the start, unless `found` or `at_limit`
  WarpOutcome outcome = WarpOutcome::none;
  double amplitude = 0;  ///< of the displacements' prior, a coordinate's standard deviation; 0
                         ///< unless `found` or `at_limit`
  double gain = 0;  ///< log evidence for the likeliest amplitude over 0, also if below min_gain
};

/// A similarity beside a smooth warp of the source. Where one cloud is bent, the residuals of
/// neighbours say the same thing, and least squares that count them as independent follow the
/// largest patch. Here displacements with a Gaussian prior, of covariance
/// amplitude^2 exp(-d^2 / (2 length^2)), take up what is smooth, which is generalised least squares
/// for the similarity (Aitken 1936). The prior's amplitude maximises the evidence of the residuals
/// (restricted maximum likelihood, Patterson and Thompson 1971): 0 where they show no warp. The
/// warp is not part of the answer. `start` must have converged.
Unwarped refine_beside_warp(const PreparedCloud& source, const PreparedCloud& target,
                            const Refined& start, const WarpOptions& options);

}  // namespace orbitfuse::registration
