// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

// Thermal samples are uint16 counts in files (T[K] = scale * count, 0 = invalid; the scale is 0.01,
// "centikelvin", unless the scene is hotter than that holds) and float kelvin in memory (NaN =
// invalid).
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

/// Steps in which thermal images are stored. 0.01 K reaches 382 C, 0.02 K 1037 C, 0.04 K 2348 C and
/// 0.1 K 6280 C: furnaces and arcs. The coarser ones add 6, 12 and 29 mK of rounding noise.
inline constexpr std::array<double, 4> stored_kelvin_per_count{kelvin_per_dn, 0.02, 0.04, 0.1};

/// The finest of them that holds the temperature; the coarsest where none does.
inline double kelvin_per_count_for(double hottest_k) {
  for (const double scale : stored_kelvin_per_count) {
    if (!(hottest_k > 65535 * scale)) return scale;
  }
  return stored_kelvin_per_count.back();
}

/// Rounds to the nearest count; 0 for a temperature that is not finite or outside the scale.
inline std::uint16_t count_from_kelvin(double temperature_k, double kelvin_per_count) {
  const double count = std::round(temperature_k / kelvin_per_count);
  return count >= 1.0 && count <= 65535.0 ? static_cast<std::uint16_t>(count) : std::uint16_t{0};
}

inline double celsius_from_kelvin(double temperature_k) { return temperature_k - celsius_zero_k; }
inline double kelvin_from_celsius(double temperature_c) { return temperature_c + celsius_zero_k; }

}  // namespace orbitfuse
