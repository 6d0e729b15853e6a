// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/registration/clouds/candidate.hpp"
#include "recon/registration/clouds/prepared_cloud.hpp"

namespace orbitfuse::registration {

/// `count` rotations, evenly spread over SO(3): super-Fibonacci spirals (Alexa 2022).
std::vector<Eigen::Quaterniond> rotation_spiral(int count);

/// Candidates without features: every rotation of a grid, at several scales, refined coarsely and
/// pruned in rounds by the two-sided score. Scored with the coarse bounds.
Candidates grid_candidates(const PreparedCloud& source, const PreparedCloud& target,
                           const RegistrationOptions& options, int most);

}  // namespace orbitfuse::registration
