// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/poses/estimate_poses.hpp"

namespace orbitfuse {

/// Views of which fewer than `fewest` points are seen by two others. Points of two views hold how a
/// pair is turned, but each pair at a scale of its own: what they chain drifts while every residual
/// is small. None for a model of two views, which has no third to ask.
///
/// Right views of ten scenes have 76 and more; in a bare hall, left out of everything else, the
/// only two below 50 (11 and 37) were 5.0 and 2.4 % of the extent off.
std::vector<DoubtfulView> weakly_held(const Reconstruction& model, int fewest = 50);

}  // namespace orbitfuse
