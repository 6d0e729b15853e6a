// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "recon/nerf/nerf.hpp"

namespace orbitfuse::nerf {

/// Steps (x, y) to four pixels round one.
using Neighbours = std::array<std::array<int, 2>, 4>;
inline constexpr Neighbours beside = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}},
                            diagonal = {{{-1, -1}, {1, -1}, {-1, 1}, {1, 1}}},
                            beside_by_two = {{{-2, 0}, {2, 0}, {0, -2}, {0, 2}}},
                            diagonal_by_two = {{{-2, -2}, {2, -2}, {-2, 2}, {2, 2}}};

/// A pixel as the mean of its neighbours, where nothing tells that there is more to be seen: they
/// differ by `alike` (of the value range) at most, and lie on one surface. False: they don't.
bool take_mean(RenderedView& view, int x, int y, const Neighbours& of, float alike);

}  // namespace orbitfuse::nerf
