// SPDX-License-Identifier: BSD-3-Clause
#include "core/radiometry/flir_temperature.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>

#include "core/temperature.hpp"

namespace orbitfuse {
namespace {

/// Water vapour in air, g/m3, from relative humidity; polynomial of FLIR's documentation.
double water_vapour(double relative_humidity, double air_k) {
  const double t = celsius_from_kelvin(air_k);
  return relative_humidity *
         std::exp(1.5587 + 0.06939 * t - 0.00027816 * t * t + 0.00000068455 * t * t * t);
}

double transmission(const AtmosphereConstants& a, const ObjectParameters& o) {
  const double d = std::sqrt(o.distance_m);
  const double w = std::sqrt(water_vapour(o.relative_humidity, o.atmospheric_k));
  return a.x * std::exp(-d * (a.alpha1 + a.beta1 * w)) +
         (1 - a.x) * std::exp(-d * (a.alpha2 + a.beta2 * w));
}

}  // namespace

ObjectParameters with_overrides(ObjectParameters o, const ObjectParameterOverrides& over) {
  o.emissivity = over.emissivity.value_or(o.emissivity);
  o.distance_m = over.distance_m.value_or(o.distance_m);
  o.reflected_k = over.reflected_temperature_k.value_or(o.reflected_k);
  o.atmospheric_k = over.atmospheric_temperature_k.value_or(o.atmospheric_k);
  o.relative_humidity = over.relative_humidity.value_or(o.relative_humidity);
  return o;
}

Status FlirCalibration::validate(const std::string& where) const {
  struct Range {
    const char* name;
    double value, low, high;
  };
  const std::array<Range, 17> ranges{{{"Planck R1", planck.r1, 1e-3, 1e9},
                                      {"Planck R2", planck.r2, 1e-9, 1e6},
                                      {"Planck B", planck.b, 1, 1e5},
                                      {"Planck F", planck.f, -100, 100},
                                      {"Planck O", planck.o, -1e7, 1e7},
                                      {"emissivity", object.emissivity, 0.01, 1},
                                      {"distance", object.distance_m, 0, 1e5},
                                      {"reflected temperature", object.reflected_k, 1, 5000},
                                      {"atmospheric temperature", object.atmospheric_k, 150, 400},
                                      {"window temperature", object.window_k, 1, 5000},
                                      {"window transmission", object.window_transmission, 0.01, 1},
                                      {"relative humidity", object.relative_humidity, 0, 1},
                                      {"atmosphere alpha1", atmosphere.alpha1, -10, 10},
                                      {"atmosphere alpha2", atmosphere.alpha2, -10, 10},
                                      {"atmosphere beta1", atmosphere.beta1, -10, 10},
                                      {"atmosphere beta2", atmosphere.beta2, -10, 10},
                                      {"atmosphere X", atmosphere.x, -10, 10}}};
  for (const Range& r : ranges) {
    if (!(r.value >= r.low && r.value <= r.high)) {
      return fail(ErrorKind::input, where + ": " + r.name,
                  fmt::format("{} is out of range", r.value),
                  "the camera did not write it; give the object parameters on import");
    }
  }
  if (const double tau = transmission(atmosphere, object); !(tau > 0.01 && tau <= 1.5)) {
    return fail(ErrorKind::input, where + ": atmosphere",
                fmt::format("transmission {} at {} m", tau, object.distance_m),
                "correct the object distance");
  }
  return {};
}

FlirThermometer::FlirThermometer(const FlirCalibration& c) : planck_(c.planck) {
  const ObjectParameters& o = c.object;
  tau_ = transmission(c.atmosphere, o);
  const double tw = o.window_transmission, e = o.emissivity;
  gain_ = 1 / (tw * tau_ * e);
  offset_ = -((1 - tw) * signal_of(o.window_k) / tw + (1 - tau_) * signal_of(o.atmospheric_k) +
              tau_ * (1 - e) * signal_of(o.reflected_k)) /
            (tau_ * e);
}

double FlirThermometer::signal_of(double kelvin) const {
  return planck_.r1 / (planck_.r2 * (std::exp(planck_.b / kelvin) - planck_.f)) - planck_.o;
}

std::vector<double> kelvin_table(const FlirCalibration& calibration) {
  const FlirThermometer thermometer(calibration);
  std::vector<double> table(65536);
  for (std::size_t s = 0; s < table.size(); ++s)
    table[s] = thermometer.kelvin(static_cast<double>(s));
  return table;
}

double FlirThermometer::signal(double kelvin) const {
  return (signal_of(kelvin) - offset_) / gain_;
}

double FlirThermometer::kelvin(double signal) const {
  const double s = gain_ * signal + offset_ + planck_.o;
  const double argument = planck_.r1 / (planck_.r2 * s) + planck_.f;
  if (!(s > 0) || !(argument > 1)) return std::numeric_limits<double>::quiet_NaN();
  return planck_.b / std::log(argument);
}

}  // namespace orbitfuse
