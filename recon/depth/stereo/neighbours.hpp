// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/depth/options.hpp"
#include "recon/depth/stereo/depth_view.hpp"

namespace orbitfuse::depth {

/// For each view the views to match it with, best first: those that look at the same place from
/// directions far enough apart for parallax and near enough to look alike.
std::vector<std::vector<int>> choose_neighbours(const std::vector<DepthView>& views,
                                                const DepthOptions& options);

}  // namespace orbitfuse::depth
