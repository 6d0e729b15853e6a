// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/thinning.hpp"

#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "core/numeric/random.hpp"

namespace orbitfuse::registration {
namespace {

struct KeyHash {
  std::size_t operator()(std::uint64_t key) const {
    key *= split_mix_step;  // neighbouring cells differ in few bits only
    return static_cast<std::size_t>(key ^ (key >> 29));
  }
};

std::uint64_t cell_key(const Eigen::Vector3d& p, double voxel) {
  const Eigen::Array3d k = ((p.array() / voxel).floor() + 1048576.0).min(2097151.0).max(0.0);
  return static_cast<std::uint64_t>(k.x()) << 42 | static_cast<std::uint64_t>(k.y()) << 21 |
         static_cast<std::uint64_t>(k.z());
}

}  // namespace

Points thinned(const Points& points, double voxel) {
  std::unordered_map<std::uint64_t, std::size_t, KeyHash> cell_of;
  cell_of.reserve(points.size());
  Points sums;
  std::vector<double> counts;
  for (const auto& p : points) {
    const auto [cell, is_new] = cell_of.try_emplace(cell_key(p, voxel), sums.size());
    if (is_new) {
      sums.push_back(p);
      counts.push_back(1);
    } else {
      sums[cell->second] += p;
      counts[cell->second] += 1;
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] /= counts[i];
  return sums;
}

Points thinned_to(const Points& points, int wanted) {
  Points distinct = thinned(points, 1e-5);
  if (static_cast<int>(distinct.size()) <= wanted) return distinct;
  double low = 1e-4, high = 1.0;
  Points best;
  for (int i = 0; i < 16; ++i) {
    const double voxel = std::sqrt(low * high);
    Points candidate = thinned(distinct, voxel);
    if (static_cast<int>(candidate.size()) > wanted) {
      low = voxel;
    } else {
      high = voxel;
      best = std::move(candidate);
      if (static_cast<int>(best.size()) > 0.93 * wanted) break;
    }
  }
  return best.empty() ? thinned(distinct, high) : best;
}

std::vector<int> strided_subset(std::size_t count, int wanted) {
  std::vector<int> subset;
  const double stride = std::max(1.0, static_cast<double>(count) / wanted);
  for (double at = 0.5 * stride; at < static_cast<double>(count); at += stride) {
    subset.push_back(static_cast<int>(at));
  }
  return subset;
}

}  // namespace orbitfuse::registration
