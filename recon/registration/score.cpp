// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/score.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace orbitfuse::registration {
namespace {

/// Mean agreement of `from` moved into the frame of `to`; lengths in the units of `to`.
double one_side(const PreparedCloud& from, const PreparedCloud& to, const std::vector<int>& subset,
                const Similarity3d& to_from, double pair, double plane, double contradiction) {
  const Eigen::Matrix3d rotation = to_from.rotation.toRotationMatrix();
  const Eigen::Matrix3d linear = to_from.scale * rotation;
  double sum = 0;
  for (const int i : subset) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Vector3d y = linear * from.points[at] + to_from.translation;
    const int j = to.nearest(y);
    if (j < 0) continue;
    const auto partner = static_cast<std::size_t>(j);
    const Eigen::Vector3d d = y - to.points[partner];
    const double reach2 = d.squaredNorm() / (pair * pair);
    if (reach2 >= 1) continue;
    const double off = std::abs(to.normals[partner].dot(d)) / plane;
    const double agree = 1 - std::max(off * off, reach2 * reach2);
    const double cosine = to.normals[partner].dot(rotation * from.normals[at]);
    if (agree > 0) sum += agree * cosine * cosine;
    if (off > 1) sum -= contradiction * std::min(off - 1, 1.0) * (1 - reach2);
  }
  return subset.empty() ? 0 : std::max(0.0, sum / static_cast<double>(subset.size()));
}

std::vector<int> all_of(const PreparedCloud& cloud) {
  std::vector<int> all(cloud.points.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

}  // namespace

double two_sided_score(const PreparedCloud& source, const PreparedCloud& target,
                       const std::vector<int>& source_subset, const std::vector<int>& target_subset,
                       const Similarity3d& target_from_source, const ScoreBounds& bounds) {
  const double forward = one_side(source, target, source_subset, target_from_source, bounds.pair,
                                  bounds.plane, bounds.contradiction);
  const double s = target_from_source.scale;
  const double backward = one_side(target, source, target_subset, target_from_source.inverse(),
                                   bounds.pair / s, bounds.plane / s, bounds.contradiction);
  return std::sqrt(forward * backward);
}

double two_sided_score(const PreparedCloud& source, const PreparedCloud& target,
                       const Similarity3d& target_from_source, const ScoreBounds& bounds) {
  return two_sided_score(source, target, all_of(source), all_of(target), target_from_source, bounds);
}

MatchFigures match_figures(const PreparedCloud& source, const PreparedCloud& target,
                           const Similarity3d& target_from_source, double distance) {
  double squares = 0, pairs = 0;
  const auto side = [&](const PreparedCloud& from, const PreparedCloud& to,
                        const Similarity3d& to_from, double target_per_to) {
    double near = 0;
    for (const auto& p : from.points) {
      const Eigen::Vector3d y = to_from * p;
      const int j = to.nearest(y);
      if (j < 0) continue;
      const double d = target_per_to * (y - to.points[static_cast<std::size_t>(j)]).norm();
      if (d > distance) continue;
      near += 1;
      squares += d * d;
    }
    pairs += near;
    return near / static_cast<double>(from.points.size());
  };
  MatchFigures figures;
  figures.source_share = side(source, target, target_from_source, 1);
  figures.target_share = side(target, source, target_from_source.inverse(), target_from_source.scale);
  figures.rmse = pairs > 0 ? std::sqrt(squares / pairs) : 0;
  return figures;
}

}  // namespace orbitfuse::registration
