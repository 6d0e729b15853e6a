// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/thermal_table.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

namespace orbitfuse::aravis {

Status PlanckParameters::validate() const {
  const std::array<std::pair<const char*, bool>, 7> checks{
      {{"R", r > 0},
       {"B", b > 0},
       {"J1", j1 != 0 && std::isfinite(j1)},
       {"ObjectEmissivity", emissivity > 0 && emissivity <= 1},
       {"ReflectedTemperature", reflected_k > 0},
       {"transmission", transmission > 0 && transmission <= 1},
       {"AtmosphericTemperature", atmosphere_k > 0}}};
  for (const auto& [field, good] : checks) {
    if (!good)
      return fail(ErrorKind::device, field, "a value without physical meaning",
                  "check the camera's calibration nodes");
  }
  if (!std::isfinite(f) || !std::isfinite(j0))
    return fail(ErrorKind::device, "F, J0", "not finite", "check the camera");
  return {};
}

Result<std::vector<double>> planck_table(const PlanckParameters& p) {
  ORBITFUSE_TRY(p.validate());
  const auto signal = [&](double kelvin) { return p.r / (std::exp(p.b / kelvin) - p.f); };
  const double reflected = (1 - p.emissivity) * p.transmission * signal(p.reflected_k);
  const double atmosphere = (1 - p.transmission) * signal(p.atmosphere_k);
  std::vector<double> table(65536, std::nan(""));
  for (std::size_t raw = 0; raw < table.size(); ++raw) {
    const double s = ((static_cast<double>(raw) - p.j0) / p.j1 - reflected - atmosphere) /
                     (p.emissivity * p.transmission);
    const double argument = p.r / s + p.f;
    if (s > 0 && argument > 1) table[raw] = p.b / std::log(argument);
  }
  return table;
}

}  // namespace orbitfuse::aravis
