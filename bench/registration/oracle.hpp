// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tests/support/cloud_scenes.hpp"

// What no method can know: the similarity that fits the damaged cloud best when every point's true
// place is given. Its error against the similarity that moved the undamaged cloud is the floor that
// the damage itself sets (a warp is no similarity).
namespace orbitfuse::scenes {

enum class Oracle {
  all_points,    ///< least squares over the source's surface points
  common,        ///< over those only that the target has points next to
  robust_common  ///< the same with Tukey weights
};

/// Nothing when too few points are left.
std::optional<Similarity3d> oracle_similarity(const CloudPair& pair, Oracle kind);

}  // namespace orbitfuse::scenes
