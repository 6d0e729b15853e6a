// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/search.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "recon/registration/clouds/features.hpp"
#include "recon/registration/clouds/match_consensus.hpp"
#include "recon/registration/clouds/rotation_grid.hpp"
#include "recon/registration/clouds/thinning.hpp"

namespace orbitfuse::registration {

Candidates best_distinct(Candidates candidates, std::size_t most) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  Candidates kept;
  for (Candidate& candidate : candidates) {
    if (kept.size() >= most) break;
    if (!(candidate.score > 0)) break;
    const bool is_new = std::all_of(kept.begin(), kept.end(), [&](const Candidate& k) {
      return distinct(k.target_from_source, candidate.target_from_source);
    });
    if (is_new) kept.push_back(std::move(candidate));
  }
  return kept;
}

Search::Search(const PreparedCloud& s, const PreparedCloud& t, const RegistrationOptions& o)
    : source(s), target(t), options(o) {
  // Options speak of the diameter, the unit frames of the radius.
  coarse = {2 * o.max_pair_distance, o.max_pair_distance, 4 * o.max_pair_distance};
  fine = {2 * o.max_pair_distance, 4 * o.inlier_distance, 0};
}

ScoreBounds Search::strict(double sigma) const {
  return {fine.pair, std::clamp(2 * sigma, std::min(0.015, fine.plane), fine.plane), 2 * fine.pair};
}

Refined Search::refine_with(const Similarity3d& start, int points, const RefineOptions& how) const {
  return refine(source, target, strided_subset(source.points.size(), points),
                strided_subset(target.points.size(), points), start, how);
}

Refined Search::measured_at(const Similarity3d& placement, int points,
                            const RefineOptions& how) const {
  return registration::measured_at(source, target, strided_subset(source.points.size(), points),
                                   strided_subset(target.points.size(), points), placement, how);
}

Agreement Search::agree(const Similarity3d& placement, int points,
                        const ScoreBounds& bounds) const {
  const double s = placement.scale;
  if (!placement.is_finite() || s < options.min_scale || s > options.max_scale) return {};
  return agreement(source, target, strided_subset(source.points.size(), points),
                   strided_subset(target.points.size(), points), placement, bounds);
}

namespace {

constexpr int all_points = 1 << 30;

/// Candidates begin far off, and only need to be told apart: a table cell's error and a steady
/// bound do.
constexpr RefineOptions brief_refinement{.start_bound = 0.25,
                                         .end_bound = 0.12,
                                         .iterations = 6,
                                         .polish = 0,
                                         .exact_partners = false,
                                         .adapt_bound = false};
/// Of the few that are left, ranked by what they end at.
constexpr RefineOptions full_refinement{
    .start_bound = 0.15, .end_bound = 0.06, .iterations = 8, .polish = 6, .settled = 2e-4};
/// From a quarter turn away: wider than brief, since the turned cloud overlaps only in part.
constexpr RefineOptions turned_refinement{.start_bound = 0.35,
                                          .end_bound = 0.2,
                                          .iterations = 5,
                                          .polish = 0,
                                          .exact_partners = false,
                                          .adapt_bound = false};

/// Candidates begin far off: partners count from far away, and nothing contradicts them yet.
constexpr ScoreBounds first_look{.pair = 0.2, .plane = 0.2, .reach = 0};

/// Coarse scores for all, a short refinement for the best, full refinement for the best of those.
Candidates narrowed(const Search& search, Candidates candidates) {
  for (Candidate& c : candidates)
    c.score = search.agree(c.target_from_source, 200, first_look).score;
  candidates = best_distinct(std::move(candidates), 30);
  for (Candidate& c : candidates) {
    if (!c.refined) {
      c.target_from_source =
          search.refine_with(c.target_from_source, 250, brief_refinement).target_from_source;
    }
    c.score = search.agree(c.target_from_source, 500, search.coarse).evidence;
  }
  candidates = best_distinct(std::move(candidates), 14);
  double sigma = INFINITY;
  for (Candidate& c : candidates) {
    if (!c.refined) {
      const Refined refined = search.refine_with(c.target_from_source, 800, full_refinement);
      c.target_from_source = refined.target_from_source;
      if (refined.pairs > 400) c.residual_sigma = refined.residual_sigma;
      c.refined = true;
    }
    if (c.residual_sigma > 0) sigma = std::min(sigma, c.residual_sigma);
  }
  for (Candidate& c : candidates)
    c.score = search.agree(c.target_from_source, all_points, search.strict(sigma)).evidence;
  candidates = best_distinct(std::move(candidates), 6);
  for (Candidate& c : candidates)
    c.agreement = search.agree(c.target_from_source, all_points, search.fine).score;
  return candidates;
}

/// The placements that a near-symmetric object could be mistaken for: quarter and half turns about
/// the source's principal axes; and shifts along the longest one, as clouds that overlap in part
/// fit better centre on centre than where they belong.
Candidates turned(const Search& search, const Candidate& best) {
  const Points& points = search.source.points;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::Matrix3d axes =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors();
  Candidates all;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double quarters : {0.0, 1.0, 2.0, 3.0}) {
      for (const double shift : {-0.5, 0.0, 0.5}) {
        if (quarters == 0 && (shift == 0 || axis > 0)) continue;
        Similarity3d turn;
        turn.rotation = Eigen::AngleAxisd(quarters * std::numbers::pi / 2, axes.col(axis));
        turn.translation = mean - turn.rotation * mean + shift * axes.col(2);
        const Similarity3d start = best.target_from_source * turn;
        all.push_back({search.refine_with(start, 150, turned_refinement).target_from_source, 0, 0,
                       best.origin + ", turned", 0, false});
      }
    }
  }
  return all;
}

Candidates with_turns(const Search& search, Candidates ranked) {
  if (ranked.empty()) return ranked;
  const Candidates turns = turned(search, ranked[0]);
  ranked.insert(ranked.end(), turns.begin(), turns.end());
  return narrowed(search, std::move(ranked));
}

bool decisive(const Candidates& ranked, const RegistrationOptions& options) {
  constexpr double borne_out = 0.45, rival_share = 0.7;
  if (ranked.empty() || ranked[0].agreement < options.decisive_score) return false;
  if (ranked[0].score < borne_out * ranked[0].agreement) return false;
  return ranked.size() < 2 || ranked[1].score < rival_share * ranked[0].score;
}

/// Candidates from descriptors, the likeliest ratio of sizes first: most pairs need no other.
Candidates feature_candidates(const Search& search) {
  constexpr double neighbourhood_radius = 0.35;
  const FeaturePoints source = feature_points(search.source, 1000);
  const FeaturePoints target = feature_points(search.target, 1000);
  const Descriptors target_descriptors = describe(target, neighbourhood_radius);
  const auto at_scale = [&](double scale) -> Candidates {
    if (scale < search.options.min_scale || scale > search.options.max_scale) return {};
    const auto matches =
        mutual_matches(describe(source, neighbourhood_radius / scale), target_descriptors, 500);
    return consensus_candidates(source, target, matches, scale, 40);
  };
  Candidates all = narrowed(search, at_scale(1));
  if (decisive(all, search.options)) {
    all = with_turns(search, std::move(all));
    if (decisive(all, search.options)) return all;
  }
  for (const double scale : {0.8, 1.25, 0.64, 1.5625}) {
    const Candidates found = at_scale(scale);
    all.insert(all.end(), found.begin(), found.end());
  }
  all = narrowed(search, std::move(all));
  return decisive(all, search.options) ? with_turns(search, std::move(all)) : all;
}

}  // namespace

Result<Found> find_placements(const Search& search, const Progress& progress) {
  Found found;
  if (search.options.use_features) found.ranked = feature_candidates(search);
  ORBITFUSE_TRY(progress.check("registration"));
  if (!search.options.use_grid) return found;
  if (decisive(found.ranked, search.options)) {
    found.skips.push_back(
        {"feature-free rotation grid",
         fmt::format("features gave a two-sided score of {:.2f}", found.ranked[0].agreement),
         "saved its search over SO(3) and scale"});
    return found;
  }
  Candidates grid = grid_candidates(search.source, search.target, search.options, 16);
  grid.insert(grid.end(), found.ranked.begin(), found.ranked.end());
  found.ranked = with_turns(search, narrowed(search, std::move(grid)));
  return found;
}

}  // namespace orbitfuse::registration
