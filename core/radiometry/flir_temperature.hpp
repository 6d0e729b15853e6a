// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse {

/// Sensor calibration of a FLIR camera: S = R1 / (R2 (exp(B / T) - F)) - O, with S and O in counts,
/// T and B in kelvin, R1 / R2 in counts, F without a unit.
struct PlanckConstants {
  double r1 = 0, r2 = 0, b = 0, f = 1;
  double o = 0;
  bool operator==(const PlanckConstants&) const = default;
};

/// Transmission of air: tau = X e^(-sqrt(d) (a1 + b1 sqrt(w))) + (1 - X) e^(-sqrt(d) (a2 + b2
/// sqrt(w))) with d in metres and w the water vapour content in g/m3.
struct AtmosphereConstants {
  double alpha1 = 0.006569, alpha2 = 0.01262, beta1 = -0.002276, beta2 = -0.00667, x = 1.9;
  bool operator==(const AtmosphereConstants&) const = default;
};

/// What the operator set in the camera.
struct ObjectParameters {
  double emissivity = 1;
  double distance_m = 0;
  double reflected_k = 293.15, atmospheric_k = 293.15, window_k = 293.15;
  double window_transmission = 1;
  double relative_humidity = 0.5;  ///< 0..1
  bool operator==(const ObjectParameters&) const = default;
};

/// Other object parameters than a file has. Absent = as in the file.
struct ObjectParameterOverrides {
  std::optional<double> emissivity;  ///< 0 < e <= 1
  std::optional<double> distance_m;  ///< >= 0
  std::optional<double> reflected_temperature_k;
  std::optional<double> atmospheric_temperature_k;
  std::optional<double> relative_humidity;  ///< 0..1

  bool any() const {
    return emissivity || distance_m || reflected_temperature_k || atmospheric_temperature_k ||
           relative_humidity;
  }
};
ObjectParameters with_overrides(ObjectParameters o, const ObjectParameterOverrides& over);

struct FlirCalibration {
  PlanckConstants planck;
  AtmosphereConstants atmosphere;
  ObjectParameters object;

  /// Input error naming the parameter that is not finite or out of range, of the file `where`.
  Status validate(const std::string& where) const;
  bool operator==(const FlirCalibration&) const = default;
};

/// Radiometric chain of FLIR's tools:
///   S = tw (tau (e S_obj + (1 - e) S_refl) + (1 - tau) S_atm) + (1 - tw) S_window,
/// solved for S_obj, then T = B / ln(R1 / (R2 (S_obj + O)) + F). Only of a calibration that
/// validate() accepts: nothing is checked here.
class FlirThermometer {
 public:
  explicit FlirThermometer(const FlirCalibration& calibration);
  /// NaN where the signal is outside what any temperature gives.
  double kelvin(double signal) const;
  /// The other way: what the sensor reads of an object at `kelvin`.
  double signal(double kelvin) const;
  double atmospheric_transmission() const { return tau_; }

 private:
  double signal_of(double kelvin) const;
  PlanckConstants planck_;
  double tau_ = 1, gain_ = 1, offset_ = 0;  ///< S_obj = gain S + offset
};

/// Of each of the 65536 signals: a table costs less than a logarithm per pixel.
std::vector<double> kelvin_table(const FlirCalibration& calibration);

}  // namespace orbitfuse
