// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

/// How second derivatives are taken. With symbol s(w) of the second difference the explicit step is
/// stable for dt * 2 max s^2 <= 2: s <= 1 for the wide stencil, s <= 4 for the compact one.
enum class Stencil {
  wide,     ///< [1 0 -2 0 1]/4, the gradient of the gradient
  compact,  ///< [1 -2 1]
};
double largest_stable_step(Stencil stencil);

struct SmootherOptions {
  /// T, of the size time_step; more moves more structure into the detail layer; the paper has 15.
  int iterations = 60;
  double time_step = 0.9;  ///< dt
  /// Cycles of fast explicit diffusion that reach the time iterations * time_step in far fewer
  /// steps; conductivities are taken once a cycle. 0 = the paper's plain steps.
  int cycles = 2;
  double edge_scale = 4;  ///< k, gray levels: second differences above it are kept as edges
  Stencil stencil = Stencil::wide;

  /// Usage error naming the field; a time step beyond the stencil's limit diverges and is refused.
  Status validate() const;
};

/// Fourth-order diffusion (You and Kaveh 2000, eq. 12), by axis:
///   I' = I - dt (D_xx (c D_xx I) + D_yy (c D_yy I)),  c = 1 / (1 + (D_xx I^2 + D_yy I^2) / k^2)
/// with mirrored borders, which keep the mean and the stability limit. Same bits for any thread
/// count. Image at least 5 x 5.
Plane smooth(const Plane& image, const SmootherOptions& options);

}  // namespace orbitfuse::fusion
