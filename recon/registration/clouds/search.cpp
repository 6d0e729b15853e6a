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
  // Two sigma: 95 % of a right placement's pairs. The floor, of the radius, is for data without
  // noise, which would rank placements by where the two clouds happen to be sampled.
  constexpr double sigmas = 2, least_plane = 0.015;
  return {fine.pair, std::clamp(sigmas * sigma, std::min(least_plane, fine.plane), fine.plane),
          2 * fine.pair};
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

// Each look at the candidates takes more points of a cloud and leaves fewer of them. More of either
// costs time in proportion; fewer points rank by chance, and fewer candidates lose the right one
// among those that look alike early. The method was tuned as a whole, on seeds that its figures
// don't use (docs/notes/registration.md); none of these was measured alone.
constexpr int first_look_points = 200;
constexpr std::size_t most_after_first_look = 30;
constexpr int brief_points = 250;
constexpr int coarse_points = 500;
constexpr std::size_t most_after_brief = 14;
constexpr int full_points = 800;
/// A quarter of what both clouds' points can have: a placement that brings fewer together doesn't
/// say how noisy the clouds are.
constexpr int fewest_sigma_pairs = full_points / 2;
/// The answer and the alternatives of the report.
constexpr std::size_t most_ranked = 6;

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
    c.score = search.agree(c.target_from_source, first_look_points, first_look).score;
  candidates = best_distinct(std::move(candidates), most_after_first_look);
  for (Candidate& c : candidates) {
    if (!c.refined) {
      c.target_from_source =
          search.refine_with(c.target_from_source, brief_points, brief_refinement)
              .target_from_source;
    }
    c.score = search.agree(c.target_from_source, coarse_points, search.coarse).evidence;
  }
  candidates = best_distinct(std::move(candidates), most_after_brief);
  double sigma = INFINITY;
  for (Candidate& c : candidates) {
    if (!c.refined) {
      const Refined refined =
          search.refine_with(c.target_from_source, full_points, full_refinement);
      c.target_from_source = refined.target_from_source;
      // Exact data have none: the bounds stay as wide as they come.
      if (refined.pairs > fewest_sigma_pairs && refined.residual_sigma > 0)
        c.residual_sigma = refined.residual_sigma;
      c.refined = true;
    }
    if (c.residual_sigma) sigma = std::min(sigma, *c.residual_sigma);
  }
  for (Candidate& c : candidates)
    c.score = search.agree(c.target_from_source, all_points, search.strict(sigma)).evidence;
  candidates = best_distinct(std::move(candidates), most_ranked);
  for (Candidate& c : candidates)
    c.agreement = search.agree(c.target_from_source, all_points, search.fine).score;
  return candidates;
}

/// The placements that a near-symmetric object could be mistaken for: quarter and half turns about
/// the source's principal axes; and shifts along the longest one, as clouds that overlap in part
/// fit better centre on centre than where they belong.
Candidates turned(const Search& search, const Candidate& best) {
  // Of the radius: shorter shifts the refinement makes itself, longer ones step over places. Few
  // points, as there are 29 of these, and narrowed() looks at all of them again.
  constexpr double shift_length = 0.5;
  constexpr int turned_points = 150;
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
      for (const double shift : {-shift_length, 0.0, shift_length}) {
        if (quarters == 0 && (shift == 0 || axis > 0)) continue;
        Similarity3d turn;
        turn.rotation = Eigen::AngleAxisd(quarters * std::numbers::pi / 2, axes.col(axis));
        turn.translation = mean - turn.rotation * mean + shift * axes.col(2);
        const Similarity3d start = best.target_from_source * turn;
        all.push_back(
            {.target_from_source =
                 search.refine_with(start, turned_points, turned_refinement).target_from_source,
             .origin = best.origin + ", turned"});
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
  // Share of the agreement that nothing contradicts, and of the best one's evidence that a rival
  // may have: higher and lower ask the second initialiser more often, for its time.
  constexpr double borne_out = 0.45, rival_share = 0.7;
  if (ranked.empty() || ranked[0].agreement < options.decisive_score) return false;
  if (ranked[0].score < borne_out * ranked[0].agreement) return false;
  return ranked.size() < 2 || ranked[1].score < rival_share * ranked[0].score;
}

/// Candidates from descriptors, the likeliest ratio of sizes first: most pairs need no other.
Candidates feature_candidates(const Search& search) {
  // Of the radius: wider tells shapes apart, and loses more neighbourhoods to cuts and holes.
  constexpr double neighbourhood_radius = 0.35;
  // Pairs of points, and of matches, are gone through one and all: time goes with the square.
  constexpr int feature_count = 1000, most_matches = 500;
  constexpr int most_cliques = 40;
  // From one size tried to the next; matches agree to nearly that (match_consensus.cpp).
  constexpr double size_step = 1.25;
  const FeaturePoints source = feature_points(search.source, feature_count);
  const FeaturePoints target = feature_points(search.target, feature_count);
  const Descriptors target_descriptors = describe(target, neighbourhood_radius);
  const auto at_scale = [&](double scale) -> Candidates {
    if (scale < search.options.min_scale || scale > search.options.max_scale) return {};
    const auto matches = mutual_matches(describe(source, neighbourhood_radius / scale),
                                        target_descriptors, most_matches);
    return consensus_candidates(source, target, matches, scale, most_cliques);
  };
  Candidates all = narrowed(search, at_scale(1));
  if (decisive(all, search.options)) {
    all = with_turns(search, std::move(all));
    if (decisive(all, search.options)) return all;
  }
  for (const double scale :
       {1 / size_step, size_step, 1 / (size_step * size_step), size_step * size_step}) {
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
  constexpr int most_of_grid = 16;
  Candidates grid = grid_candidates(search.source, search.target, search.options, most_of_grid);
  grid.insert(grid.end(), found.ranked.begin(), found.ranked.end());
  found.ranked = with_turns(search, narrowed(search, std::move(grid)));
  return found;
}

}  // namespace orbitfuse::registration
