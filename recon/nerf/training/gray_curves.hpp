// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "recon/nerf/dataset.hpp"

namespace orbitfuse::nerf {

/// What an 8-bit thermal camera on automatic did to each view: it chose gain, level and (where it
/// equalises the histogram) a curve anew for each, so that one surface has other gray levels in
/// every view. A curve leads a view's levels to levels that all share.
struct GrayCurves {
  std::vector<GrayCurve> of_view;  ///< empty where `points` are too few
  double spread = 0;               ///< RMS of how far samples move, levels of 255
  double left = 0;                 ///< median disagreement of two views afterwards, levels
  double before = 0;               ///< and before
  int points = 0;                  ///< places of the maps that two views or more see

  /// Else images are better left as they are: of one span for all views, as some programs export
  /// them.
  bool told() const;
};

/// From what the views that train see of the same points, as estimate_shading() finds them: each
/// view's curve is linear between knots and smooth, curve(view, level) = a(point) by robust least
/// squares, and the curves' mean is the identity. Views that share too few points keep a nearly
/// straight one; views held out have no say, and follow the others. The common levels are stretched
/// to 0..255. `depth`: of all views.
GrayCurves estimate_gray_curves(const Dataset& dataset, const std::vector<DepthMap>& depth,
                                const std::vector<bool>& heldout);

}  // namespace orbitfuse::nerf
