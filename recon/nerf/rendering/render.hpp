// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/field/field_state.hpp"
#include "recon/nerf/field/view_rays.hpp"
#include "recon/nerf/nerf.hpp"

namespace orbitfuse::nerf {

/// Renders pixels (x0 + i * stride, y0 + j * stride), i.e. an image of ceil(size / stride). Values
/// are in units of the span (kelvin = low + value * (high - low)).
RenderedView render_strided(const FieldState& field, const ViewRays& rays, int stride,
                            const RenderOptions& options);

}  // namespace orbitfuse::nerf
