// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "recon/nerf/dataset.hpp"
#include "recon/nerf/training/scene.hpp"

namespace orbitfuse::nerf {

/// What a camera on automatic did from view to view: each channel of a view is that of the common
/// exposure times a gain (stored sRGB samples; a factor of light is nearly a factor of these too).
struct Exposure {
  std::vector<Eigen::Array3d>
      log_gain;  ///< per view, R, G, B; zero of views that share fewer than 50 samples
  double spread = 0, largest = 0;  ///< RMS over views that train; the one farthest from zero
  int points = 0;                  ///< seen by two views that train or more

  /// Shading that depends on the direction alone reaches 2 % (rendered container, one exposure).
  /// One wild view among many is told by itself.
  bool varies() const { return spread > 0.04 || largest > 0.15; }
};

/// From what the views that train see of the same points: SfM tracks, and dense depth where some
/// view has few. Each channel solves log I(view, point) = log_gain(view) + a(point) by robust least
/// squares (weights fall with the square of the residual), gains with mean zero. Views held out
/// have no say; their own gains are the median against points that both its nearest views see.
Exposure estimate_exposure(const Dataset& dataset, const std::vector<bool>& heldout);

/// Divides each view's target by its gain. What the camera clipped becomes unknown where the common
/// exposure would have shown it, and stays clipped elsewhere.
void even_out(const Exposure& exposure, std::vector<NormalisedView>& views);

}  // namespace orbitfuse::nerf
