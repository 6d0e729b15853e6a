// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "recon/poses/known/line_misses.hpp"

namespace orbitfuse {

/// Sets of views whose poses fit each other and no other set's, as of two reconstructions that were
/// put into one file: no single view is wrong.
struct Blocks {
  std::vector<std::vector<int>> frames;  ///< each of three or more, by their first
  Held across;                           ///< matches between them
};

/// Nothing where all views that can be told hang together, where what lies between sets is too
/// little, and of less than nine frames.
/// `all_off`: by how many times all poses are less precise than right ones, 1 or more.
std::optional<Blocks> separate_blocks(const std::vector<PairMisses>& misses, int frames,
                                      double all_off);

}  // namespace orbitfuse
