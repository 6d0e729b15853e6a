// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/poses/estimate_poses.hpp"

// Internal to recon/poses.
namespace orbitfuse {

/// Unless the view is in doubt already.
void add_doubt(DoubtfulView view, std::vector<DoubtfulView>& doubtful);

}  // namespace orbitfuse
