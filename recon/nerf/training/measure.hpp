// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/field/field_state.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/nerf/training/pose_steps.hpp"

namespace orbitfuse::nerf {

/// PSNR in dB of a strided picture over finite pixels of the target, values clamped to 0..1.
double psnr_of(const RenderedView& picture, const cv::Mat& target, int stride);

/// How a strided picture of the view's scene asks its camera to move.
PoseSums sums_of(const RenderedView& picture, int stride, const Space& space,
                 const NormalisedView& view);

/// Mean PSNR in dB over the held-out views; NaN without any. With `align`, they first follow the
/// field, which moves with the views that train.
double heldout_psnr(FieldState& field, std::vector<NormalisedView>& views,
                    const std::vector<bool>& heldout, bool align);

/// Best held-out PSNR of a curve, dB; -infinity where none is finite.
double peak_db(const std::vector<CurvePoint>& curve);

/// Whether the curve's last point is worse than its peak by more than two or three views vary from
/// step to step, or measured nothing. Otherwise the longer trained field is the better one.
bool fell(const std::vector<CurvePoint>& curve);

}  // namespace orbitfuse::nerf
