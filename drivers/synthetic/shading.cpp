// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/synthetic/shading.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/synthetic/noise.hpp"

namespace orbitfuse::synthetic {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector3d random_color(std::uint64_t hash) {
  // Saturated hues in many brightnesses, as stickers and rubbish have.
  const double hue = 6 * uniform(mix(hash, 1)), light = 0.15 + 0.8 * uniform(mix(hash, 2));
  const double saturation = 0.2 + 0.7 * uniform(mix(hash, 3));
  const Vector3d pure(std::clamp(std::abs(hue - 3) - 1, 0.0, 1.0),
                      std::clamp(2 - std::abs(hue - 2), 0.0, 1.0),
                      std::clamp(2 - std::abs(hue - 4), 0.0, 1.0));
  return light * ((1 - saturation) * Vector3d::Ones() + saturation * pure);
}

/// Patches (ellipses and rectangles) scattered over a surface: the cells of a grid hold at most
/// one.
void paste_decals(const Vector2d& uv, double cell_size, double density, std::uint64_t seed,
                  Vector3d& color) {
  const Vector2d at = uv / cell_size;
  const Vector2d cell = at.array().floor();
  std::uint64_t h = mix(seed, static_cast<std::uint64_t>(static_cast<std::int64_t>(cell.x())));
  h = mix(h, static_cast<std::uint64_t>(static_cast<std::int64_t>(cell.y())));
  if (uniform(mix(h, 11)) > density) return;
  const Vector2d half(0.12 + 0.22 * uniform(mix(h, 12)), 0.10 + 0.22 * uniform(mix(h, 13)));
  const Vector2d center(0.38 + 0.24 * uniform(mix(h, 14)), 0.38 + 0.24 * uniform(mix(h, 15)));
  const double turn = 3.14159 * uniform(mix(h, 16));
  const Vector2d d = at - cell - center;
  const Vector2d p(d.x() * std::cos(turn) + d.y() * std::sin(turn),
                   d.y() * std::cos(turn) - d.x() * std::sin(turn));
  const Vector2d q = (p.array() / half.array()).abs();
  const bool inside = h & 1 ? q.maxCoeff() < 1 : q.squaredNorm() < 1;
  if (inside) color = random_color(mix(h, 17));
}

/// Surface coordinates on the two axes that the normal is least along.
Vector2d face_coordinates(const Vector3d& x, const Vector3d& n) {
  const Vector3d a = n.cwiseAbs();
  if (a.z() >= a.x() && a.z() >= a.y()) return {x.x(), x.y()};
  return a.x() > a.y() ? Vector2d(x.y(), x.z()) : Vector2d(x.x(), x.z());
}

std::uint64_t face_seed(std::uint64_t seed, const Vector3d& n) {
  const Vector3d a = n.cwiseAbs();
  const int axis = a.z() >= a.x() && a.z() >= a.y() ? 2 : a.x() > a.y() ? 0 : 1;
  return mix(seed, static_cast<std::uint64_t>(2 * axis + (n[axis] > 0 ? 1 : 0)));
}

bool is_window(const Vector3d& x, const Vector3d& n) {
  if (n.z() > 0.93 || x.z() > 1.36 || x.z() < 0.98) return false;
  if (std::abs(n.y()) > 0.7) return x.x() > -1.25 && x.x() < 0.42 && std::abs(x.x() + 0.42) > 0.05;
  return std::abs(x.y()) < 0.60;
}

/// Stretches noise about its middle: octaves average out most of the contrast.
double contrast(double noise, double gain) {
  return std::clamp(0.5 + gain * (noise - 0.5), 0.0, 1.0);
}

struct Surface {
  Vector3d albedo = Vector3d::Constant(0.5);
  double gloss = 0;   ///< weight of the sun's highlight
  double mirror = 0;  ///< sky mirrored at normal incidence; grows to 1 at grazing angles (Schlick)
};

Surface surface_at(const Solid& solid, const Vector3d& x, const Vector3d& n) {
  Surface s;
  const std::uint64_t seed = solid.seed, face = face_seed(seed, n);
  const Vector2d uv = face_coordinates(x, n);
  const double fine = fractal_noise(x * 9, 4, seed),
               coarse = fractal_noise(x * 1.1, 3, mix(seed, 2));
  switch (solid.material) {
    case Material::ground: {
      const double stains = contrast(fractal_noise(x * 3.2, 4, mix(seed, 9)), 3.0);
      s.albedo = Vector3d(0.42, 0.40, 0.37) *
                 (0.25 + 0.55 * stains + 0.55 * contrast(fine, 2.5) + 0.2 * coarse);
      paste_decals(uv, 0.9, 0.35, face, s.albedo);
      paste_decals(uv + Vector2d(40, 40), 0.33, 0.20, mix(face, 5), s.albedo);
      const double line =
          std::min(std::abs(std::abs(x.y()) - 2.45), std::abs(std::abs(x.x() + 0.3) - 4.6));
      if (line < 0.05 && fine > 0.36) s.albedo = Vector3d(0.78, 0.77, 0.70);
      break;
    }
    case Material::paint:
    case Material::cabin:
      s.albedo = Vector3d(0.10, 0.22, 0.42) * (0.5 + contrast(fine, 2.0));
      if (fractal_noise(x * 3.0, 4, mix(seed, 9)) > 0.52)
        s.albedo = Vector3d(0.42, 0.36, 0.22) * (0.5 + contrast(fine, 2.0));
      paste_decals(uv, 0.42, 0.75, face, s.albedo);
      paste_decals(uv + Vector2d(9, 9), 0.15, 0.35, mix(face, 5), s.albedo);
      s.gloss = 0.35;
      s.mirror = 0.03;
      if (solid.material == Material::cabin && is_window(x, n))
        s = {Vector3d(0.03, 0.035, 0.04), 0.6, 0.10};
      break;
    case Material::tyre:
      s.albedo = Vector3d::Constant(0.05 + 0.05 * fine);
      break;
    case Material::rim: {
      const double angle = std::atan2(x.z() - solid.center().z(), x.x() - solid.center().x());
      s.albedo = Vector3d::Constant(std::sin(5 * angle) > 0 ? 0.62 : 0.12) * (0.8 + 0.3 * fine);
      s.gloss = 0.3;
      break;
    }
    case Material::trim:
      s.albedo = Vector3d::Constant(0.09 + 0.10 * fine);
      break;
    case Material::lamp:
      s = {Vector3d(0.75, 0.70, 0.62) * (0.6 + 0.4 * coarse), 0.6, 0.06};
      break;
    case Material::exhaust:
      s = {Vector3d::Constant(0.35), 0.3, 0.05};
      break;
    case Material::crate:
    case Material::barrel:
      s.albedo = random_color(seed) * (0.4 + contrast(fine, 2.5));
      paste_decals(uv, 0.16, 0.55, face, s.albedo);
      break;
    case Material::brick:
      s.albedo = Vector3d(0.55, 0.38, 0.25) * (0.35 + 1.2 * contrast(fine, 2.5));
      break;
    case Material::building:
      s.albedo = (0.5 * random_color(seed) + Vector3d::Constant(0.2)) *
                 (0.3 + 1.2 * contrast(coarse, 2.5));
      paste_decals(uv, 2.0, 0.6, face, s.albedo);
      break;
  }
  return s;
}

Vector3d sky_radiance(const Vector3d& direction) {
  const double up = std::clamp(direction.z(), 0.0, 1.0);
  const Vector3d horizon(0.78, 0.80, 0.80), zenith(0.30, 0.45, 0.72);
  const double haze = fractal_noise(3 * direction, 3, 99);
  return horizon + (zenith - horizon) * std::pow(up, 0.55) +
         Vector3d::Constant(0.06 * (haze - 0.5));
}

double bump(const Vector3d& x, const Vector3d& center, const Vector3d& width) {
  return std::exp(-0.5 * ((x - center).array() / width.array()).square().sum());
}

double car_body_k(const Vector3d& x, const Vector3d& n) {
  const double engine = bump(x, {1.45, 0.12, 0.85}, {0.42, 0.45, 0.30});
  const double tunnel = bump(x, {0.2, -0.2, 0.25}, {1.2, 0.3, 0.25});
  const double sun = std::max(0.0, n.dot(Scene::sun_direction()));
  return 297.5 + 24 * engine + 6 * tunnel + 5.5 * sun + 1.5 * (x.x() + 2) / 4;
}

}  // namespace

Vector3d visible_radiance(const Scene& scene, const Ray& ray, const Hit& hit) {
  if (!hit.solid) return sky_radiance(ray.direction);
  const Vector3d x = ray.origin + hit.distance * ray.direction;
  const Vector3d& n = hit.normal;
  const Surface s = surface_at(scene.solid(*hit.solid), x, n);
  const double facing = std::max(0.0, n.dot(Scene::sun_direction()));
  const bool lit = facing > 0 && !scene.is_shadowed(x + 1e-4 * n);
  // Less sky is seen close to the ground beside and under the car.
  const double under_car = std::exp(-std::max(0.0, std::abs(x.y()) - 0.75) / 0.25 -
                                    std::max(0.0, std::abs(x.x()) - 1.9) / 0.25 - x.z() / 0.18);
  const double sky_light = (0.30 + 0.16 * n.z()) * (1 - 0.75 * under_car);
  Vector3d radiance = s.albedo.cwiseProduct(Vector3d(0.85, 0.95, 1.1) * sky_light);
  if (lit) radiance += s.albedo.cwiseProduct(Vector3d(1.0, 0.95, 0.86) * facing);
  if (s.gloss > 0 || s.mirror > 0) {
    const Vector3d mirrored = ray.direction - 2 * ray.direction.dot(n) * n;
    const double grazing = 1 - std::abs(ray.direction.dot(n));
    const double fresnel =
        s.mirror + (1 - s.mirror) * std::pow(grazing, 5) * (s.mirror > 0 ? 1 : 0);
    const Vector3d seen = mirrored.z() > 0 ? sky_radiance(mirrored) : Vector3d(0.22, 0.21, 0.20);
    radiance = (1 - fresnel) * radiance + fresnel * seen;
    if (lit)
      radiance += Vector3d::Constant(
          s.gloss * std::pow(std::max(0.0, mirrored.dot(Scene::sun_direction())), 60));
  }
  return radiance;
}

double temperature_k(const Scene& scene, const Ray& ray, const Hit& hit) {
  constexpr double air_k = 288.5;
  if (!hit.solid) return 258.0 + 14 * std::exp(-6 * std::max(0.0, ray.direction.z()));
  const Solid& solid = scene.solid(*hit.solid);
  const Vector3d x = ray.origin + hit.distance * ray.direction;
  const double sun = std::max(0.0, hit.normal.dot(Scene::sun_direction()));
  const double own = uniform(mix(solid.seed, 77));
  switch (solid.material) {
    case Material::ground: {
      const double below_engine = bump(x, {1.4, 0, 0}, {0.7, 0.6, 1});
      const double in_shade = bump(x, {-0.3, 0.5, 0}, {1.6, 0.9, 1});
      return air_k + 3.5 + 0.8 * fractal_noise(0.45 * x, 2, 7) + 5 * below_engine - 2.2 * in_shade;
    }
    case Material::paint:
      return car_body_k(x, hit.normal);
    case Material::cabin:
      return is_window(x, hit.normal) ? 291.0 + 1.2 * (x.z() - 1) + 1.5 * sun
                                      : car_body_k(x, hit.normal) - 1;
    case Material::tyre:
      return 300.5 + 4 * bump(x, {x.x(), x.y(), 0}, {1, 1, 0.15});
    case Material::rim:
      return 309.0 + 8 * bump(x, solid.center(), {0.09, 1, 0.09});
    case Material::trim:
      return 295.0 + 2.5 * sun + (x.x() > 1 ? 4 : 0);
    case Material::lamp:
      return 293.5 + (x.x() > 0 ? 3 : 0);
    case Material::exhaust:
      return 335.0;
    case Material::crate:
    case Material::barrel:
    case Material::brick:
      return air_k + 1.5 + 3 * own + 2.5 * sun + 0.8 * (x.z() - solid.center().z());
    case Material::building:
      return air_k + 0.5 + 2.5 * own + 2 * sun - 0.25 * x.z();
  }
  return air_k;
}

}  // namespace orbitfuse::synthetic
