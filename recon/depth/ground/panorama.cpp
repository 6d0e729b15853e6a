// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/ground/panorama.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace orbitfuse::depth {
namespace {

/// Half a degree either way: twice as fine as the points of a depth map lie, and no finer.
constexpr int azimuths = 360, elevations = 180;

}  // namespace

Panorama::Panorama(const Eigen::Vector3f& eye, const LevelPlane& plane,
                   const std::vector<std::vector<Eigen::Vector3f>>& points)
    : eye_(eye),
      up_(plane.normal.cast<float>()),
      ahead_(plane.normal.unitOrthogonal().cast<float>()),
      left_(up_.cross(ahead_)),
      nearest_(azimuths * elevations, std::numeric_limits<float>::infinity()) {
  for (const auto& some : points)
    for (const Eigen::Vector3f& point : some) {
      const Direction d = direction_of(point);
      float& here = nearest_[static_cast<std::size_t>(d.azimuth * elevations + d.elevation)];
      here = std::min(here, d.distance);
    }
  for (int a = 0; a < azimuths; ++a)
    for (int e = elevations - 2; e >= 0; --e) {
      float* here = &nearest_[static_cast<std::size_t>(a * elevations + e)];
      here[0] = std::min(here[0], here[1]);
    }
}

Panorama::Direction Panorama::direction_of(const Eigen::Vector3f& place) const {
  const Eigen::Vector3f to = place - eye_;
  const float x = to.dot(ahead_), y = to.dot(left_);
  const float turns = std::atan2(y, x) / (2 * std::numbers::pi_v<float>)+0.5f;
  const float height = to.dot(up_) / std::max(to.norm(), 1e-12f);  // sine of the elevation
  const float share = std::asin(std::clamp(height, -1.f, 1.f)) / std::numbers::pi_v<float> + 0.5f;
  return {std::clamp(static_cast<int>(turns * azimuths), 0, azimuths - 1),
          std::clamp(static_cast<int>(share * elevations), 0, elevations - 1), std::hypot(x, y)};
}

bool Panorama::hides(const Eigen::Vector3f& place, float share) const {
  const Direction d = direction_of(place);
  if (d.elevation + 1 >= elevations) return false;
  return nearest_[static_cast<std::size_t>(d.azimuth * elevations + d.elevation + 1)] <
         share * d.distance;
}

}  // namespace orbitfuse::depth
