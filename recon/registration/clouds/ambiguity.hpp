// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/registration/clouds/candidate.hpp"
#include "recon/registration/clouds/refine.hpp"

namespace orbitfuse::registration {

/// Which motion the surfaces leave open, in words ("rotation about an axis", "size"), from the
/// small eigenvalues of the refinement's Hessian; "" when all seven are held.
std::string open_directions(const Matrix7& hessian);

}  // namespace orbitfuse::registration
