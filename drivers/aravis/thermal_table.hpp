// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/result.hpp"

namespace orbitfuse::aravis {

/// FLIR's signal model (A3xx, A6xx, A50-A700, Ax5): S = (raw - J0) / J1, and for the object alone
/// T = B / ln(R / S_object + F).
struct PlanckParameters {
  double r = 0, b = 0, f = 1, j0 = 0, j1 = 1;
  double emissivity = 1, reflected_k = 293.15;
  double transmission = 1, atmosphere_k = 293.15;

  Status validate() const;
};

/// Kelvin of every 16-bit sample; NaN where the signal has no temperature.
Result<std::vector<double>> planck_table(const PlanckParameters& parameters);

}  // namespace orbitfuse::aravis
