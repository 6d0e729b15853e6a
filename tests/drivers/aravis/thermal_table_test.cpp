// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/thermal_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orbitfuse::aravis {
namespace {

PlanckParameters camera() {
  PlanckParameters p;
  p.r = 16000;
  p.b = 1430;
  p.f = 1;
  p.j0 = 100;
  p.j1 = 40;
  return p;
}

/// The raw value that an object would give: the forward model, written independently.
double raw_of(const PlanckParameters& p, double kelvin) {
  const auto s = [&](double t) { return p.r / (std::exp(p.b / t) - p.f); };
  const double seen = p.emissivity * p.transmission * s(kelvin) +
                      (1 - p.emissivity) * p.transmission * s(p.reflected_k) +
                      (1 - p.transmission) * s(p.atmosphere_k);
  return p.j0 + p.j1 * seen;
}

TEST(ThermalTable, PlanckInvertsTheForwardModel) {
  for (double emissivity : {1.0, 0.95, 0.5}) {
    for (double transmission : {1.0, 0.9}) {
      PlanckParameters p = camera();
      p.emissivity = emissivity;
      p.transmission = transmission;
      const auto table = planck_table(p);
      ASSERT_TRUE(table);
      for (double kelvin : {260.0, 300.0, 350.0, 420.0, 500.0}) {
        const double raw = raw_of(p, kelvin);
        const double slope = raw_of(p, kelvin + 1) - raw;  // counts per kelvin
        const auto dn = static_cast<std::size_t>(std::lround(raw));
        EXPECT_NEAR((*table)[dn], kelvin, 0.6 / slope) << emissivity << " " << kelvin;
      }
    }
  }
}

TEST(ThermalTable, TheHotRangeOfACameraIsInIt) {
  PlanckParameters p = camera();
  p.j1 = 10;
  const auto table = planck_table(p);
  ASSERT_TRUE(table);
  for (double kelvin : {700.0, 900.0, 1100.0})
    EXPECT_NEAR((*table)[static_cast<std::size_t>(std::lround(raw_of(p, kelvin)))], kelvin, 0.1);
}

TEST(ThermalTable, NoSignalHasNoTemperature) {
  const auto table = planck_table(camera());
  ASSERT_TRUE(table);
  EXPECT_TRUE(std::isnan((*table)[0]));
  EXPECT_TRUE(std::isnan((*table)[100]));
}

TEST(ThermalTable, NonsenseIsNamed) {
  PlanckParameters p = camera();
  p.j1 = 0;
  EXPECT_EQ(planck_table(p).error().where, "J1");
  p = camera();
  p.emissivity = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(planck_table(p).error().where, "ObjectEmissivity");
}

}  // namespace
}  // namespace orbitfuse::aravis
