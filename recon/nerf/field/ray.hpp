// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse::nerf {

struct Ray {
  float origin[3];     ///< normalised scene space
  float direction[3];  ///< unit length
  float forward;       ///< cosine to the optical axis: z depth = distance * forward
};

}  // namespace orbitfuse::nerf
