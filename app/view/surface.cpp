// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/surface.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>

#include "core/geometry/kd_tree.hpp"
#include "core/numeric/median.hpp"
#include "core/numeric/random.hpp"
#include "core/temperature.hpp"

namespace orbitfuse::view {
namespace {

/// Beyond it a phone's frame rate falls below 30 a second, and the surface looks no denser.
constexpr std::size_t most_points = 300'000;

/// At most most_points of a cloud, in no order: the first of them, alone, are spread over the
/// whole.
PointCloud thinned(const PointCloud& cloud) {
  std::vector<std::size_t> order(cloud.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = order.size(); i > 1; --i)
    std::swap(order[i - 1], order[random_bits(1, 0, i) % i]);
  PointCloud kept;
  for (const std::size_t i : order) {
    if (kept.size() >= most_points) break;
    if (!cloud.positions[i].allFinite()) continue;
    kept.positions.push_back(cloud.positions[i]);
    if (!cloud.colors.empty()) kept.colors.push_back(cloud.colors[i]);
    if (!cloud.temperatures_k.empty()) kept.temperatures_k.push_back(cloud.temperatures_k[i]);
  }
  return kept;
}

/// Median distance of points to their nearest neighbours, squared.
double spacing2(const KdTree& tree, const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> nearest;
  for (std::size_t i = 0; i < points.size(); i += std::max<std::size_t>(1, points.size() / 1000)) {
    std::size_t index[2];
    double distance2[2];
    if (tree.nearest(points[i], 2, index, distance2) == 2) nearest.push_back(distance2[1]);
  }
  return median_in(nearest);
}

template <class Number>
void append(std::string& bytes, Number value) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof raw);
}

}  // namespace

PointCloud surface_of(const PointCloud& visible, PointCloud thermal) {
  PointCloud surface = thinned(visible.empty() ? thermal : visible);
  if (visible.empty() || thermal.empty()) return surface;
  thermal = thinned(thermal);
  if (thermal.empty()) return surface;
  const KdTree tree(thermal.positions);
  const double reach2 = 9 * spacing2(tree, thermal.positions);
  surface.temperatures_k.reserve(surface.size());
  for (const Eigen::Vector3d& p : surface.positions) {
    std::size_t index = 0;
    double distance2 = 0;
    const bool near = tree.nearest(p, 1, &index, &distance2) == 1 && distance2 <= reach2;
    surface.temperatures_k.push_back(near ? thermal.temperatures_k[index] : invalid_k);
  }
  return surface;
}

std::string packed(const PointCloud& surface, double kelvin_per_count) {
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = low;
  if (!surface.empty()) low = high = surface.positions.front();
  for (const Eigen::Vector3d& p : surface.positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  constexpr double steps = 65535;
  const Eigen::Vector3d step = ((high - low) / steps).cwiseMax(1e-12);
  std::string bytes;
  bytes.reserve(28 + surface.size() * 11 + 1);
  append(bytes, static_cast<std::uint32_t>(surface.size()));
  for (const Eigen::Vector3d& v : {low, step})
    for (int d = 0; d < 3; ++d) append(bytes, static_cast<float>(v[d]));
  for (const Eigen::Vector3d& p : surface.positions)
    for (int d = 0; d < 3; ++d)
      append(bytes, static_cast<std::uint16_t>(
                        std::clamp(std::round((p[d] - low[d]) / step[d]), 0.0, steps)));
  for (std::size_t i = 0; i < surface.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      append(bytes, surface.colors.empty() ? std::uint8_t{128} : surface.colors[i][c]);
  if (bytes.size() % 2 != 0) bytes.push_back('\0');
  for (std::size_t i = 0; i < surface.size(); ++i)
    append(bytes, surface.temperatures_k.empty()
                      ? std::uint16_t{0}
                      : count_from_kelvin(static_cast<double>(surface.temperatures_k[i]),
                                          kelvin_per_count));
  return bytes;
}

std::string packed(const TriangleMesh& mesh) {
  float hottest_k = 0;
  for (const float k : mesh.vertices.temperatures_k) hottest_k = std::max(hottest_k, k);
  const double kelvin_per_count = kelvin_per_count_for(static_cast<double>(hottest_k));
  std::string bytes;
  append(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  append(bytes, static_cast<float>(kelvin_per_count));
  bytes += packed(mesh.vertices, kelvin_per_count);
  bytes.resize((bytes.size() + 3) / 4 * 4);
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) append(bytes, corner);
  return bytes;
}

}  // namespace orbitfuse::view
