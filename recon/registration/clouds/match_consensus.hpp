// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/registration/clouds/candidate.hpp"
#include "recon/registration/clouds/features.hpp"

namespace orbitfuse::registration {

/// Similarities on which many matches agree. Two matches agree when the two segments between their
/// ends differ by a scale near `scale` and meet the normals at the same angles; matches with many
/// common friends (second-order consistency, Chen et al. 2022) span a clique, whose similarity GNC
/// estimates. Not scored.
Candidates consensus_candidates(const FeaturePoints& source, const FeaturePoints& target,
                                const std::vector<Match>& matches, double scale, int most);

}  // namespace orbitfuse::registration
