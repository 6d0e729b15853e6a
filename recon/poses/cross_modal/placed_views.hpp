// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "recon/alignment/view_verdict.hpp"

namespace orbitfuse {

/// A view in the visible world, with what its pose is worth.
struct PlacedView {
  PosedView view;
  ViewVerdict verdict;
  double agreement = 0;    ///< of edges
  double residual_px = 0;  ///< median
};

/// Thermal views as one method placed them.
struct PlacedViews {
  std::vector<PlacedView> views;
  std::string method, why;
  std::vector<std::string> warnings;  ///< about more than one view
  std::map<std::string, double> gates;
};

}  // namespace orbitfuse
