// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/field/field_state.hpp"
#include "recon/nerf/nerf.hpp"

namespace orbitfuse::nerf {

/// Renders pixels (x0 + i * stride, y0 + j * stride), i.e. an image of ceil(size / stride). Values
/// are in units of the span (kelvin = low + value * (high - low)).
RenderedView render_strided(const FieldState& field, const ViewRays& rays, int stride,
                            const RenderOptions& options);

/// PSNR in dB of a strided picture over finite pixels of the target, values clamped to 0..1.
double psnr_of(const RenderedView& picture, const cv::Mat& target, int stride);

/// How a strided picture of the view's scene asks its camera to move.
PoseSums sums_of(const RenderedView& picture, int stride, const Space& space, const NormalisedView& view);

}  // namespace orbitfuse::nerf
