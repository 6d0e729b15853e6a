// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>
#include <vector>

#include "core/session/session.hpp"

namespace orbitfuse {

using ViewPair = std::pair<int, int>;  ///< first < second

/// Every pair.
std::vector<ViewPair> exhaustive_pairs(int count);

/// Pairs worth matching on an orbit, at most a fifth of the exhaustive ones, but as many as two
/// loops of twelve have (all for 11 views and fewer): the nearest in direction where frames carry
/// stations, so neighbours in azimuth, adjacent loops and the closure; else neighbours in capture
/// order, with closures at growing strides. Every view keeps at least two partners.
std::vector<ViewPair> orbit_pairs(const std::vector<const FrameRecord*>& frames);

/// The `most` of all pairs that come first in that order.
std::vector<ViewPair> nearest_pairs(const std::vector<const FrameRecord*>& frames,
                                    std::size_t most);

}  // namespace orbitfuse
