// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/geometry/reconstruction.hpp"

namespace orbitfuse {

/// How uncertain the place of each view's camera is, as its points and their residuals say: one
/// standard deviation of the center, as a share of the RMS distance of the centers from their
/// middle. From the inverse of the normal matrix of bundle adjustment with the points eliminated
/// (Triggs et al., Bundle adjustment: a modern synthesis, 2000, section 9) in the gauge that moves
/// the cameras least, by the RMS residual of the view's points that two others see; focal lengths
/// and distortion as known. Only noise is counted: a false match that nothing contradicts is not.
/// Infinite for a view that no point holds. Empty for less than three views, and for more than 400,
/// where the dense matrix would cost more than it tells: so many views overlap.
std::vector<double> center_uncertainty(const Reconstruction& model);

}  // namespace orbitfuse
