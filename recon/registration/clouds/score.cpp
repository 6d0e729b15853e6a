// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/score.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

namespace orbitfuse::registration {
namespace {

struct Side {
  double agree = 0, against = 0;  ///< per point
};

/// `from` moved into the frame of `to`; lengths in the units of `to`.
Side one_side(const PreparedCloud& from, const PreparedCloud& to, const std::vector<int>& subset,
              const Similarity3d& to_from, const ScoreBounds& bounds, double unit) {
  constexpr double steep_share = 0.7;  // height over distance: beside an edge or a cut says nothing
  const double pair2 = unit * unit * bounds.pair * bounds.pair, plane = unit * bounds.plane;
  const double reach2 = bounds.reach * bounds.reach * unit * unit;
  const Eigen::Matrix3d rotation = to_from.rotation.toRotationMatrix();
  const Eigen::Matrix3d linear = to_from.scale * rotation;
  Side side;
  for (const int i : subset) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Vector3d y = linear * from.points[at] + to_from.translation;
    const std::optional<std::size_t> partner = to.nearest(y);
    if (!partner) continue;
    const Eigen::Vector3d d = y - to.points[*partner];
    const double d2 = d.squaredNorm(), height = std::abs(to.normals[*partner].dot(d)),
                 off = height / plane;
    if (d2 < reach2 && off > 1 && height * height > steep_share * steep_share * d2) {
      side.against += std::min(off - 1, 1.0) * (1 - d2 / reach2);
    }
    if (d2 >= pair2) continue;
    const double agree = 1 - std::max(off * off, d2 * d2 / (pair2 * pair2));
    const double cosine = to.normals[*partner].dot(rotation * from.normals[at]);
    if (agree > 0) side.agree += agree * cosine * cosine;
  }
  const double count = std::max<double>(1, static_cast<double>(subset.size()));
  return {side.agree / count, side.against / count};
}

std::vector<int> all_of(const PreparedCloud& cloud) {
  std::vector<int> all(cloud.points.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

}  // namespace

Agreement agreement(const PreparedCloud& source, const PreparedCloud& target,
                    const std::vector<int>& source_subset, const std::vector<int>& target_subset,
                    const Similarity3d& target_from_source, const ScoreBounds& bounds) {
  // A contradicted point weighs ten agreeing ones: overlap alone must not outvote it.
  constexpr double against_weight = 10;
  const Side forward = one_side(source, target, source_subset, target_from_source, bounds, 1);
  const Side backward = one_side(target, source, target_subset, target_from_source.inverse(),
                                 bounds, 1 / target_from_source.scale);
  Agreement result;
  result.score = std::sqrt(forward.agree * backward.agree);
  if (!(result.score > 0)) return {};
  const auto borne_out = [&](const Side& side) {
    return side.agree / (side.agree + against_weight * side.against);
  };
  result.evidence = result.score * std::sqrt(borne_out(forward) * borne_out(backward));
  return result;
}

Agreement agreement(const PreparedCloud& source, const PreparedCloud& target,
                    const Similarity3d& target_from_source, const ScoreBounds& bounds) {
  return agreement(source, target, all_of(source), all_of(target), target_from_source, bounds);
}

MatchFigures match_figures(const PreparedCloud& source, const PreparedCloud& target,
                           const Similarity3d& target_from_source, double distance) {
  double squares = 0, pairs = 0;
  const auto side = [&](const PreparedCloud& from, const PreparedCloud& to,
                        const Similarity3d& to_from, double target_per_to) {
    double near = 0;
    for (const auto& p : from.points) {
      const Eigen::Vector3d y = to_from * p;
      const std::optional<std::size_t> partner = to.nearest(y);
      if (!partner) continue;
      const double d = target_per_to * (y - to.points[*partner]).norm();
      if (d > distance) continue;
      near += 1;
      squares += d * d;
    }
    pairs += near;
    return near / static_cast<double>(from.points.size());
  };
  MatchFigures figures;
  figures.source_share = side(source, target, target_from_source, 1);
  figures.target_share =
      side(target, source, target_from_source.inverse(), target_from_source.scale);
  figures.rmse = pairs > 0 ? std::sqrt(squares / pairs) : 0;
  return figures;
}

}  // namespace orbitfuse::registration
