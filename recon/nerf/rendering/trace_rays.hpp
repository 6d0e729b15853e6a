// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "recon/nerf/field/traced_ray.hpp"
#include "recon/nerf/rendering/ray_block.hpp"

namespace orbitfuse::nerf {

/// The i-th ray; false: there is none (outside the lens model's field).
using RayOf = std::function<bool(int i, DrawnRay& ray)>;

/// What `count` rays show, out[i] of the i-th; on the device in use (recon/nerf/device), if one is
/// and the field's sampling allows. Throws device::Refused.
void trace_rays(const FieldState& field, const ForwardSettings& limits, const MarchSettings& march,
                int count, const RayOf& ray_of, TracedRay* out);

}  // namespace orbitfuse::nerf
