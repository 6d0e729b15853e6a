// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <string>

namespace orbitfuse {

/// A share of 0..1 in words: "37 %". Only nothing is "0 %" and only all is "100 %": what rounds to
/// them is "under 1 %" or "over 99 %". "unknown" of what is no number.
inline std::string percent(double share) {
  if (!std::isfinite(share)) return "unknown";
  if (share > 0 && share < 0.005) return "under 1 %";
  if (share < 1 && share > 0.995) return "over 99 %";
  return std::to_string(std::lround(100 * share)) + " %";
}

}  // namespace orbitfuse
