// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/known_fit.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace orbitfuse {
namespace {

/// The camera of a source at the image's own size; nothing when the shapes differ.
std::optional<Camera> fitted(const Camera& camera, cv::Size size) {
  if (camera.width == size.width && camera.height == size.height) return camera;
  const double aspect = static_cast<double>(camera.width) / camera.height;
  if (std::abs(aspect * size.height / size.width - 1) > 0.01) return std::nullopt;
  return camera.scaled_to(size.width, size.height);
}

}  // namespace

void KnownFit::apply(const KnownViews& known, const KnownView* view, cv::Size size, Frame& frame,
                     DeviceInfo& device) {
  if (view) apply_view(*view, size, frame, device);
  if (known.shared_camera() && !options_.ground_truth_priors_only)
    device.lens.calibrated = fitted(*known.shared_camera(), size);
}

void KnownFit::apply_view(const KnownView& view, cv::Size size, Frame& frame, DeviceInfo& device) {
  const std::optional<Camera> camera = fitted(view.camera, size);
  if (!camera) {
    const bool exchanged = fitted(view.camera, {size.height, size.width}).has_value();
    Error misfit{ErrorKind::input, frame.source,
                 fmt::format("{}x{} does not fit its known camera of {}x{}{}", size.width,
                             size.height, view.camera.width, view.camera.height,
                             exchanged ? " (w and h are exchanged)" : ""),
                 "pose not used"};
    remarks_.add_of_file("", misfit.where, misfit.found + "; " + misfit.remedy);
    if (!first_misfit_) first_misfit_ = std::move(misfit);
    return;
  }
  ++fitting_;
  if (options_.ground_truth_priors_only) {
    device.lens.focal_px = camera->fx;
    return;
  }
  frame.camera = camera;
  frame.cam_from_world = view.cam_from_world;
}

Status KnownFit::check() const {
  if (!first_misfit_ || fitting_ > 0) return {};
  return fail(
      ErrorKind::input, "known poses",
      fmt::format("not one can be used; {}: {}", first_misfit_->where, first_misfit_->found),
      "correct the size in the poses' file, or give the poses of these images");
}

}  // namespace orbitfuse
