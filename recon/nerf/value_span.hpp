// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse::nerf {

/// Linear map from stored samples to what the network learns: value = low + (high - low) * target.
struct ValueSpan {
  double low = 0, high = 1;
};

}  // namespace orbitfuse::nerf
