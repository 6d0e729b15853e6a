// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/stereo/neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace orbitfuse::depth {
namespace {

/// Share of a lattice of points round the scene's centre that both views hold.
double overlap(const DepthView& a, const DepthView& b) {
  const auto holds = [](const DepthView& v, const Eigen::Vector3f& x) {
    const Eigen::Vector3f c = v.world_rotation * x + v.translation;
    if (c.z() <= 0.02f) return false;
    const Eigen::Vector2d p = v.camera.project(c.cast<double>());
    return p.x() >= 0 && p.y() >= 0 && p.x() < v.camera.width && p.y() < v.camera.height;
  };
  int both = 0, first = 0;
  for (int z = -2; z <= 2; ++z)
    for (int y = -2; y <= 2; ++y)
      for (int x = -2; x <= 2; ++x) {
        const Eigen::Vector3f at =
            0.2f *
            Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
        if (!holds(a, at)) continue;
        ++first;
        both += holds(b, at);
      }
  return first > 0 ? static_cast<double>(both) / first : 0.0;
}

}  // namespace

std::vector<std::vector<int>> choose_neighbours(const std::vector<DepthView>& views,
                                                const DepthOptions& options) {
  // Patches match best near 15 degrees of parallax; smaller angles cost depth resolution faster
  // than larger ones cost resemblance.
  constexpr double best_deg = 15, narrow_deg = 6, wide_deg = 22;
  std::vector<std::vector<int>> out(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::vector<std::pair<double, int>> scored;
    for (std::size_t j = 0; j < views.size(); ++j) {
      if (i == j) continue;
      const Eigen::Vector3f a = views[i].center(), b = views[j].center();
      // Directions to the centre of the scene: what a view looks at matters, not how it is turned.
      const double cosine = std::clamp<double>(a.normalized().dot(b.normalized()), -1, 1);
      const double angle = std::acos(cosine) * 180 / std::numbers::pi;
      if (!(angle >= options.min_angle_deg && angle <= options.max_angle_deg)) continue;
      const double off = (angle - best_deg) / (angle < best_deg ? narrow_deg : wide_deg);
      const double score = std::exp(-0.5 * off * off) * overlap(views[i], views[j]);
      if (score > 1e-3) scored.push_back({-score, static_cast<int>(j)});
    }
    std::sort(scored.begin(), scored.end());
    for (const auto& [score, j] : scored)
      if (static_cast<int>(out[i].size()) < options.neighbours) out[i].push_back(j);
  }
  return out;
}

}  // namespace orbitfuse::depth
