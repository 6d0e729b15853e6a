// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace orbitfuse {

/// Frames, features and points are counted in int, as COLMAP and Eigen do; the standard library's
/// containers ask for its own type. `index` is at least 0.
inline std::size_t at(int index) { return static_cast<std::size_t>(index); }

}  // namespace orbitfuse
