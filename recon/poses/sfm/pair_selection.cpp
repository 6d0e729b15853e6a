// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/pair_selection.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "core/numeric/angle_units.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// Degrees between the directions of two stations; a loop apart costs a little more than its
/// angle, since a change of elevation foreshortens most surfaces.
double station_distance_deg(const Station& a, const Station& b) {
  const auto direction = [](const Station& s) {
    const double azimuth = s.azimuth_deg * radians_per_degree;
    const double elevation = std::clamp(s.elevation_deg, -89.0, 89.0) * radians_per_degree;
    return Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                           std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  };
  const double cosine = std::clamp(direction(a).dot(direction(b)), -1.0, 1.0);
  return std::acos(cosine) / radians_per_degree + 10.0 * std::abs(a.loop - b.loop);
}

/// Steps in capture order: 0 to neighbours, more to far ones; strides 7, 10, 14, ... serve orbits
/// whose period is unknown.
double order_distance(int first, int second, int count) {
  const int gap = std::min(second - first, count - (second - first));
  return gap <= 3 ? gap : 3.0 + std::log2(gap / 3.0) + (gap % 3 == 0 ? 0.0 : 2.0);
}

}  // namespace

std::vector<ViewPair> exhaustive_pairs(int count) {
  std::vector<ViewPair> pairs;
  for (int i = 0; i < count; ++i)
    for (int j = i + 1; j < count; ++j) pairs.emplace_back(i, j);
  return pairs;
}

std::vector<ViewPair> orbit_pairs(const std::vector<const FrameRecord*>& frames) {
  // Fewer than two loops of twelve have leave a chain of few views with links missing.
  constexpr int pairs_of_two_loops = 55;
  const int count = static_cast<int>(frames.size());
  return nearest_pairs(
      frames, static_cast<std::size_t>(std::max(count * (count - 1) / 10, pairs_of_two_loops)));
}

std::vector<ViewPair> nearest_pairs(const std::vector<const FrameRecord*>& frames,
                                    std::size_t most) {
  const int count = static_cast<int>(frames.size());
  const bool stations = all_have_stations(frames);

  std::vector<std::tuple<double, int, int>> candidates;
  for (const auto& [i, j] : exhaustive_pairs(count)) {
    const auto& a = *frames[static_cast<std::size_t>(i)];
    const auto& b = *frames[static_cast<std::size_t>(j)];
    candidates.emplace_back(
        stations ? station_distance_deg(*a.station, *b.station) : order_distance(i, j, count), i,
        j);
  }
  std::sort(candidates.begin(), candidates.end());

  std::set<ViewPair> chosen;
  std::vector<int> partners(static_cast<std::size_t>(count), 0);
  const auto take = [&](int i, int j) {
    if (!chosen.insert({i, j}).second) return;
    ++partners[static_cast<std::size_t>(i)];
    ++partners[static_cast<std::size_t>(j)];
  };
  // Two partners for every view first, so that the limit can't starve a lonely one.
  for (const auto& [distance, i, j] : candidates)
    if (partners[static_cast<std::size_t>(i)] < 2 || partners[static_cast<std::size_t>(j)] < 2)
      if (chosen.size() < most) take(i, j);
  for (const auto& [distance, i, j] : candidates) {
    if (chosen.size() >= most) break;
    take(i, j);
  }
  return {chosen.begin(), chosen.end()};
}

}  // namespace orbitfuse
