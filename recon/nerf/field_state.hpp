// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/modality.hpp"
#include "recon/nerf/space.hpp"

namespace orbitfuse::nerf {

struct FieldState {
  Modality modality = Modality::visible;
  Space space;
  int step = 0;
};

}  // namespace orbitfuse::nerf
