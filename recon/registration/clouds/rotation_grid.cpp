// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/rotation_grid.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "recon/registration/clouds/refine.hpp"
#include "recon/registration/clouds/score.hpp"
#include "recon/registration/clouds/thinning.hpp"

namespace orbitfuse::registration {
namespace {

struct Round {
  int points, iterations;
  double start_bound, end_bound;
  std::optional<std::size_t> keep = {};  ///< nothing: what the caller wants at most
};

}  // namespace

std::vector<Eigen::Quaterniond> rotation_spiral(int count) {
  const double phi = std::numbers::sqrt2, psi = 1.533751168755204288118041;
  std::vector<Eigen::Quaterniond> rotations;
  for (int i = 0; i < count; ++i) {
    const double s = i + 0.5, r = std::sqrt(s / count), big_r = std::sqrt(1 - s / count);
    const double alpha = 2 * std::numbers::pi * s / phi, beta = 2 * std::numbers::pi * s / psi;
    rotations.emplace_back(big_r * std::cos(beta), r * std::sin(alpha), r * std::cos(alpha),
                           big_r * std::sin(beta));
  }
  return rotations;
}

Candidates grid_candidates(const PreparedCloud& source, const PreparedCloud& target,
                           const RegistrationOptions& options, int most) {
  Candidates candidates;
  for (const double scale : {1.0, 0.8, 1.25}) {
    if (scale < options.min_scale || scale > options.max_scale) continue;
    for (const auto& rotation : rotation_spiral(scale == 1.0 ? 600 : 300)) {
      candidates.push_back({.target_from_source = {scale, rotation, Eigen::Vector3d::Zero()},
                            .origin = "rotation grid"});
    }
  }
  constexpr Round rounds[] = {
      {.points = 60, .iterations = 3, .start_bound = 0.6, .end_bound = 0.4, .keep = 240},
      {.points = 120, .iterations = 4, .start_bound = 0.4, .end_bound = 0.25, .keep = 60},
      {.points = 250, .iterations = 5, .start_bound = 0.25, .end_bound = 0.15}};
  for (const Round& round : rounds) {
    const auto source_subset = strided_subset(source.points.size(), round.points);
    const auto target_subset = strided_subset(target.points.size(), round.points);
    const RefineOptions coarse{.start_bound = round.start_bound,
                               .end_bound = round.end_bound,
                               .iterations = round.iterations,
                               .polish = 0,
                               .exact_partners = false,
                               .adapt_bound = false};
    const ScoreBounds bounds{round.end_bound, round.end_bound};
    for (Candidate& candidate : candidates) {
      candidate.target_from_source =
          refine(source, target, source_subset, target_subset, candidate.target_from_source, coarse)
              .target_from_source;
      const double s = candidate.target_from_source.scale;
      candidate.score = s < options.min_scale || s > options.max_scale
                            ? 0
                            : agreement(source, target, source_subset, target_subset,
                                        candidate.target_from_source, bounds)
                                  .score;
    }
    candidates =
        best_distinct(std::move(candidates), round.keep.value_or(static_cast<std::size_t>(most)));
  }
  return candidates;
}

}  // namespace orbitfuse::registration
