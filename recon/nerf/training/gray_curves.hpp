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
  double left = 0;     ///< median of how far samples are from their points' levels afterwards
  double before = 0;   ///< and before
  double variety = 0;  ///< median of how far points' levels are from the median one, afterwards
  /// Of the curves over each view's own samples. The identity in their mean, they may still be flat
  /// where each view has its levels, if these disagree and lie apart.
  double slope = 1;
  /// Correlation of views' common levels, about the means of each pair. Few views of a wide range
  /// among narrow ones make a slope small as well; their levels then go together.
  double agreement = 1;
  int points = 0;                     ///< places of the maps that two views or more see
  std::vector<std::size_t> reversed;  ///< views that show hot as black where most show it white
  bool training_reversed = false;     ///< one of these trains
  /// Views that share too little with others: their curve says nothing.
  std::vector<std::size_t> alone;

  /// Else images are better left as they are: of one span for all views, as some programs export
  /// them.
  bool told() const;
  /// Curves that bring views together by telling nothing apart any more.
  bool flattened() const;
  /// Views disagree, and no curves bring them together.
  bool contradict() const;
};

/// From what the views that train see of the same points, as estimate_shading() finds them: each
/// view's curve is linear between knots, smooth and rising, curve(view, level) = a(point) by robust
/// least squares, and the curves' mean is the identity. A view whose levels fall where the others'
/// rise is turned first. Views held out have no say, and follow the others. What training images
/// show (but for one pixel in a thousand at either end) is stretched to 0..255. `depth`: of all
/// views.
GrayCurves estimate_gray_curves(const Dataset& dataset, const std::vector<DepthMap>& depth,
                                const std::vector<bool>& heldout);

}  // namespace orbitfuse::nerf
