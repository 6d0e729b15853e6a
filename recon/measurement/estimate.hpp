// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/measurement/options.hpp"

namespace orbitfuse::measurement {

/// One frame's temperature at a place.
struct WeightedReading {
  double temperature_k = 0;
  double gradient_k_per_px = 0;
  double weight = 0;  ///< against the others; above 0
};

/// What several frames say together, and how far off it may be.
struct Estimate {
  double temperature_k = 0;
  double uncertainty_k = 0;  ///< TemperatureReading::uncertainty_k
  double spread_k = 0;       ///< NaN: one frame
  // What the uncertainty is made of, one sigma each; for bench/measurement.
  double statistical_k = 0, gradient_k = 0, disagreement_k = 0;
};

/// The weighted mean of the readings near their weighted median: what lies 3 robust sigmas off it
/// is another surface. `field_k` may be NaN. `readings` isn't empty, and holds finite numbers.
Estimate estimate(const std::vector<WeightedReading>& readings, double field_k,
                  const MeasurementOptions& options);

/// The value below which half of the weight lies.
double weighted_median(std::vector<std::pair<double, double>> value_and_weight);

}  // namespace orbitfuse::measurement
