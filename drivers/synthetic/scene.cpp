// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/synthetic/scene.hpp"

#include <cmath>
#include <numbers>

#include "drivers/synthetic/noise.hpp"

namespace orbitfuse::synthetic {
namespace {

using Eigen::Vector3d;

Vector3d polar(double azimuth_deg, double radius, double z) {
  const double a = azimuth_deg * std::numbers::pi / 180;
  return {radius * std::cos(a), radius * std::sin(a), z};
}

/// Low things within the visible orbit: they show in both modalities and hide nothing.
void add_clutter(Random& random, std::vector<Solid>& solids) {
  for (int i = 0; i < 26; ++i) {
    const double azimuth = 360.0 * i / 26 + random.uniform(-5, 5);
    const double height = random.uniform(0.05, 0.14);
    const Vector3d center = polar(azimuth, random.uniform(2.75, 3.9), height);
    const Vector3d half(random.uniform(0.08, 0.22), random.uniform(0.07, 0.16), height);
    const auto seed = static_cast<std::uint64_t>(1000 + i);
    if (i % 5 == 3) {
      const double r = random.uniform(0.10, 0.17), h = random.uniform(0.12, 0.26);
      solids.push_back(Solid::cylinder({center.x(), center.y(), h}, Vector3d::UnitZ(), r, h)
                           .with(Material::barrel, split_mix(seed)));
    } else {
      solids.push_back(Solid::box(center, half, random.uniform(0, 180))
                           .with(i % 3 == 0 ? Material::crate : Material::brick, split_mix(seed)));
    }
  }
}

/// Far beyond both orbits.
void add_buildings(Random& random, std::vector<Solid>& solids) {
  for (int i = 0; i < 17; ++i) {
    const double azimuth = 360.0 * i / 17 + random.uniform(-6, 6);
    const double height = random.uniform(1.2, 4.6);
    const Vector3d half(random.uniform(1.0, 3.2), random.uniform(1.0, 2.6), height);
    solids.push_back(
        Solid::box(polar(azimuth, random.uniform(19, 30), height), half, random.uniform(0, 180))
            .with(Material::building, split_mix(static_cast<std::uint64_t>(2000 + i))));
  }
}

}  // namespace

Scene::Scene(std::uint64_t seed) : seed_(seed) {
  solids_.push_back(Solid().with(Material::ground, mix(seed, 3)));
  for (Solid& part : make_car(seed)) solids_.push_back(std::move(part));
  Random random(mix(seed, 5));
  add_clutter(random, solids_);
  add_buildings(random, solids_);
}

Vector3d Scene::sun_direction() { return Vector3d(0.45, -0.55, 0.70).normalized(); }

Hit Scene::intersect(const Ray& ray, double min_distance) const {
  Hit hit;
  if (ray.direction.z() < -1e-9) {
    const double t = -ray.origin.z() / ray.direction.z();
    if (t > min_distance) hit = {t, Vector3d::UnitZ(), 0};
  }
  for (std::size_t i = 1; i < solids_.size(); ++i) {
    if (solids_[i].intersect(ray, min_distance, hit)) hit.solid = static_cast<int>(i);
  }
  return hit;
}

bool Scene::is_shadowed(const Vector3d& point) const {
  const Ray ray{point, sun_direction()};
  Hit hit;
  for (std::size_t i = 1; i < solids_.size(); ++i) {
    if (solids_[i].intersect(ray, 1e-3, hit)) return true;
  }
  return false;
}

}  // namespace orbitfuse::synthetic
