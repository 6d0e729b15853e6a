// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

// Thermal samples are uint16 centikelvin in files (T[K] = 0.01 DN, 0 = invalid) and float kelvin
// in memory (NaN = invalid).
namespace orbitfuse {

inline constexpr double kelvin_per_dn = 0.01;
inline constexpr double celsius_zero_k = 273.15;
inline constexpr float invalid_k = std::numeric_limits<float>::quiet_NaN();

inline float kelvin_from_centikelvin(std::uint16_t dn) {
  return dn == 0 ? invalid_k : static_cast<float>(dn * kelvin_per_dn);
}

/// Rounds to the nearest DN; a temperature that is not finite or outside 0.01..655.35 K is 0.
inline std::uint16_t centikelvin_from_kelvin(float temperature_k) {
  const double dn = std::round(static_cast<double>(temperature_k) / kelvin_per_dn);
  return dn >= 1.0 && dn <= 65535.0 ? static_cast<std::uint16_t>(dn) : std::uint16_t{0};
}

inline double celsius_from_kelvin(double temperature_k) { return temperature_k - celsius_zero_k; }
inline double kelvin_from_celsius(double temperature_c) { return temperature_c + celsius_zero_k; }

}  // namespace orbitfuse
