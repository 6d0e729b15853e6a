// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/measurement/options.hpp"

namespace orbitfuse::measurement {

/// One frame's temperature at a place.
struct WeightedReading {
  double temperature_k = 0;
  double gradient_k_per_px = 0;
  double weight = 1;  ///< against the others; above 0
};

/// What several frames say together, and how far off it may be.
struct Estimate {
  double temperature_k = 0;
  double uncertainty_k = 0;  ///< TemperatureReading::uncertainty_k
  double spread_k = 0;       ///< NaN: one frame
  // What the uncertainty is made of, one sigma each; for bench/measurement.
  double statistical_k = 0, gradient_k = 0, disagreement_k = 0, variation_k = 0;
  double assumed_k = 0;  ///< TemperatureReading::assumed_k
};

/// Which readings an estimate is made of.
struct Agreement {
  std::vector<bool> near;  ///< those that agree with the weighted median
  /// Too few to tell who is right, or too many against the median: none is left out, and the
  /// spread of all is how unsure the place is.
  bool two_camps = false;
  bool uses(std::size_t reading) const { return two_camps || near[reading]; }
  bool all_near() const;
};

/// What the field has at the place.
struct FieldReading {
  double temperature_k = 0;  ///< NaN: not known
  double variation_k = 0;    ///< SurfacePoint::variation_k
  double gain = 1;           ///< of changed object parameters: what no frame shows grows by it
};

/// A reading 3 robust sigmas off the weighted median, more than its gradient explains, is another
/// surface. `readings` isn't empty, and holds finite numbers.
Agreement agreement_of(const std::vector<WeightedReading>& readings,
                       const MeasurementOptions& options);

/// The weighted mean of the readings that `agreement` uses.
Estimate estimate(const std::vector<WeightedReading>& readings, const Agreement& agreement,
                  const FieldReading& field, const MeasurementOptions& options);

/// The value below which half of the weight lies.
double weighted_median(std::vector<std::pair<double, double>> value_and_weight);

}  // namespace orbitfuse::measurement
