// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/synthetic/noise.hpp"
#include "drivers/synthetic/scene.hpp"

namespace orbitfuse::synthetic {

using Eigen::Vector3d;

/// A hatchback, asymmetric on purpose (load on the roof, one exhaust, a spare canister): front and
/// back, left and right must not be interchangeable.
std::vector<Solid> make_car(std::uint64_t seed) {
  std::vector<Solid> parts;
  std::uint64_t next_seed = mix(seed, 17);
  const auto add = [&](const Solid& solid, Material material) {
    next_seed = split_mix(next_seed);
    parts.push_back(solid.with(material, next_seed));
  };
  add(Solid::prism({{-2.05, 0.28},
                    {2.05, 0.26},
                    {2.12, 0.60},
                    {1.98, 0.78},
                    {0.95, 0.93},
                    {-1.90, 0.98},
                    {-2.12, 0.72}},
                   0.86, 0.08, 0.6),
      Material::paint);
  add(Solid::prism({{-1.80, 0.93}, {1.00, 0.90}, {0.20, 1.42}, {-1.15, 1.45}}, 0.83, 0.30, 0.93),
      Material::cabin);
  for (const double x : {1.28, -1.30}) {
    for (const double y : {0.80, -0.80}) {
      const double out = y > 0 ? 1 : -1;
      add(Solid::cylinder({x, y, 0.32}, Vector3d::UnitY(), 0.32, 0.11), Material::tyre);
      add(Solid::cylinder({x, y + out * 0.015, 0.32}, Vector3d::UnitY(), 0.20, 0.11),
          Material::rim);
    }
  }
  add(Solid::box({2.10, 0, 0.40}, {0.06, 0.78, 0.09}), Material::trim);
  add(Solid::box({-2.10, 0, 0.42}, {0.06, 0.80, 0.10}), Material::trim);
  for (const double y : {0.62, -0.62}) {
    add(Solid::box({2.04, y, 0.64}, {0.06, 0.15, 0.06}), Material::lamp);
    add(Solid::box({-2.06, y, 0.76}, {0.06, 0.10, 0.10}), Material::lamp);
    add(Solid::box({0.68, y * 1.53, 1.00}, {0.07, 0.09, 0.06}), Material::paint);
    add(Solid::box({-0.45, y * 0.90, 1.49}, {0.62, 0.025, 0.025}), Material::trim);
  }
  add(Solid::box({-2.13, 0.05, 0.62}, {0.03, 0.26, 0.06}), Material::lamp);
  add(Solid::box({-0.70, 0.14, 1.60}, {0.30, 0.36, 0.09}, 6), Material::crate);
  add(Solid::box({-0.10, -0.22, 1.57}, {0.22, 0.20, 0.06}, -11), Material::crate);
  add(Solid::cylinder({-0.72, -0.40, 1.59}, {1, 0.1, 0}, 0.075, 0.34), Material::barrel);
  add(Solid::cylinder({-2.14, -0.52, 0.30}, Vector3d::UnitX(), 0.045, 0.10), Material::exhaust);
  add(Solid::box({-2.18, 0.46, 0.62}, {0.07, 0.14, 0.17}), Material::crate);
  return parts;
}

}  // namespace orbitfuse::synthetic
