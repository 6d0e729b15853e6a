// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "fusion/fuse/fuse.hpp"

namespace orbitfuse::testing {

inline constexpr float nan = std::numeric_limits<float>::quiet_NaN();

inline FusionOptions by_heat() {
  FusionOptions options;
  options.method = FusionMethod::heat;
  return options;
}

}  // namespace orbitfuse::testing
