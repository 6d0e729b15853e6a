// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/register.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>
#include <random>

#include "recon/registration/ambiguity.hpp"
#include "recon/registration/features.hpp"
#include "recon/registration/match_consensus.hpp"
#include "recon/registration/refine.hpp"
#include "recon/registration/rotation_grid.hpp"
#include "recon/registration/score.hpp"
#include "recon/registration/thinning.hpp"

namespace orbitfuse {
namespace registration {

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

namespace {

// Right placements stay above these but for clouds that are mostly outliers.
constexpr double kWeakScore = 0.25, kWeakEvidence = 0.04;

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Both clouds and the subsets the coarse work uses.
struct Search {
  const PreparedCloud& source;
  const PreparedCloud& target;
  const RegistrationOptions& options;
  ScoreBounds coarse, fine;

  Search(const PreparedCloud& s, const PreparedCloud& t, const RegistrationOptions& o)
      : source(s), target(t), options(o) {
    // Options speak of the diameter, the unit frames of the radius.
    coarse = {2 * o.max_pair_distance, 2 * o.max_pair_distance, 0};
    fine = {2 * o.max_pair_distance, 4 * o.inlier_distance, 0};
  }

  /// As strict as the clouds are clean: the best placement's residuals are noise.
  ScoreBounds strict(double sigma) const {
    return {fine.pair, std::clamp(2 * sigma, 0.015, fine.plane), 2 * fine.pair};
  }
  Refined refine_with(const Similarity3d& start, int points, const RefineOptions& how) const {
    return refine(source, target, strided_subset(source.points.size(), points),
                  strided_subset(target.points.size(), points), start, how);
  }
  Agreement agree(const Similarity3d& placement, int points, const ScoreBounds& bounds) const {
    const double s = placement.scale;
    if (!placement.is_finite() || s < options.min_scale || s > options.max_scale) return {};
    return agreement(source, target, strided_subset(source.points.size(), points),
                     strided_subset(target.points.size(), points), placement, bounds);
  }
};

/// Coarse scores for all, a short refinement for the best, full refinement for the best of those.
Candidates narrowed(const Search& search, Candidates candidates) {
  constexpr RefineOptions brief_refinement{0.25, 0.12, 6, 0, false, false};
  constexpr RefineOptions full_refinement{0.15, 0.06, 8, 6, true, true};
  for (Candidate& c : candidates) c.score = search.agree(c.target_from_source, 200, {0.2, 0.2, 0}).score;
  candidates = best_distinct(std::move(candidates), 24);
  for (Candidate& c : candidates) {
    c.target_from_source = search.refine_with(c.target_from_source, 250, brief_refinement).target_from_source;
    c.score = search.agree(c.target_from_source, 500, search.coarse).score;
  }
  candidates = best_distinct(std::move(candidates), 12);
  double sigma = INFINITY;
  for (Candidate& c : candidates) {
    const Refined refined = search.refine_with(c.target_from_source, 800, full_refinement);
    c.target_from_source = refined.target_from_source;
    if (refined.pairs > 400) sigma = std::min(sigma, refined.residual_sigma);
  }
  for (Candidate& c : candidates) {
    c.score = search.agree(c.target_from_source, 1 << 30, search.strict(sigma)).evidence;
    c.agreement = search.agree(c.target_from_source, 1 << 30, search.fine).score;
  }
  return best_distinct(std::move(candidates), 6);
}

/// The placements that a near-symmetric object could be mistaken for: quarter and half turns about
/// the source's principal axes.
Candidates turned(const Search& search, const Candidate& best) {
  const Points& points = search.source.points;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::Matrix3d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors();
  Candidates all;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double quarters : {1.0, 2.0, 3.0}) {
      Similarity3d turn;
      turn.rotation = Eigen::AngleAxisd(quarters * std::numbers::pi / 2, axes.col(axis));
      turn.translation = mean - turn.rotation * mean;
      all.push_back({best.target_from_source * turn, 0, 0, best.origin + ", turned"});
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
  constexpr double kBorneOut = 0.45, kRival = 0.7;
  if (ranked.empty() || ranked[0].agreement < options.decisive_score) return false;
  if (ranked[0].score < kBorneOut * ranked[0].agreement) return false;
  return ranked.size() < 2 || ranked[1].score < kRival * ranked[0].score;
}

/// Candidates from descriptors, the likeliest ratio of sizes first: most pairs need no other.
Candidates feature_candidates(const Search& search) {
  constexpr double kRadius = 0.35;
  const FeaturePoints source = feature_points(search.source, 1000);
  const FeaturePoints target = feature_points(search.target, 1000);
  const Descriptors target_descriptors = describe(target, kRadius);
  const auto at_scale = [&](double scale) -> Candidates {
    if (scale < search.options.min_scale || scale > search.options.max_scale) return {};
    const auto matches = mutual_matches(describe(source, kRadius / scale), target_descriptors, 500);
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

struct Found {
  Candidates ranked;  ///< best first, refined
  std::vector<Skip> skips;
};

Result<Found> search_all(const Search& search, const Progress& progress) {
  Found found;
  found.ranked = feature_candidates(search);
  ORBITFUSE_TRY(progress.check("registration"));
  if (decisive(found.ranked, search.options)) {
    found.skips.push_back({"feature-free rotation grid",
                           fmt::format("features gave a two-sided score of {:.2f}", found.ranked[0].agreement),
                           "saved its search over SO(3) and scale"});
    return found;
  }
  Candidates grid = grid_candidates(search.source, search.target, search.options, 12);
  grid.insert(grid.end(), found.ranked.begin(), found.ranked.end());
  found.ranked = with_turns(search, narrowed(search, std::move(grid)));
  return found;
}

void measure_spread(const Search& search, const Refined& best, RegistrationReport& report) {
  std::mt19937 random(search.options.seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < search.options.restarts; ++i) {
    Vector7 kick;
    for (int k = 0; k < 7; ++k) kick[k] = 0.035 * unit(random);
    const Similarity3d start = updated(best.target_from_source, best.target_from_source.translation, kick);
    const Similarity3d end = search.refine_with(start, 600, {0.12, 0.06, 6, 4, true, true}).target_from_source;
    report.spread_rotation_deg =
        std::max(report.spread_rotation_deg,
                 rotation_angle_deg(end.rotation, best.target_from_source.rotation));
    report.spread_scale_percent =
        std::max(report.spread_scale_percent,
                 100 * std::abs(std::log(end.scale / best.target_from_source.scale)));
    report.spread_translation_percent =
        std::max(report.spread_translation_percent,
                 50 * (end.translation - best.target_from_source.translation).norm());
  }
}

void add_words(std::string& text, const std::string& words) {
  if (!text.empty()) text += "; ";
  text += words;
}

/// Last refinement on all points and everything the report says about the result.
RegistrationReport reported(const Search& search, const Similarity3d& start) {
  constexpr RefineOptions last{0.10, 0.06, 5, 20, true, true};
  const Refined best = search.refine_with(start, 1 << 30, last);
  RegistrationReport report;
  const Similarity3d target_from_unit = search.target.unit_from_cloud.inverse();
  report.target_from_source = target_from_unit * best.target_from_source * search.source.unit_from_cloud;
  report.score = search.agree(best.target_from_source, 1 << 30, search.fine).score;
  report.evidence = search.agree(best.target_from_source, 1 << 30, search.strict(best.residual_sigma)).evidence;
  const MatchFigures matched = match_figures(search.source, search.target, best.target_from_source,
                                             2 * search.options.inlier_distance);
  const MatchFigures near = match_figures(search.source, search.target, best.target_from_source,
                                          2 * search.options.max_pair_distance);
  report.matching_ratio = matched.source_share;
  report.rmse = matched.rmse * target_from_unit.scale;
  report.rmse_percent_of_diameter = 100 * matched.rmse / 2;
  report.overlap_source = near.source_share;
  report.overlap_target = near.target_share;
  measure_spread(search, best, report);
  if (const std::string open = open_directions(best.hessian); !open.empty()) {
    report.ambiguous = true;
    add_words(report.ambiguity, "the shape leaves open: " + open);
  }
  if (report.score < kWeakScore || report.evidence < kWeakEvidence) {
    report.ambiguous = true;
    add_words(report.ambiguity, fmt::format("the clouds support it weakly (score {:.2f}, evidence {:.2f})",
                                            report.score, report.evidence));
  }
  return report;
}

}  // namespace
}  // namespace registration

using namespace registration;

Result<RegistrationReport> register_clouds(const PointCloud& source_cloud, const PointCloud& target_cloud,
                                           const RegistrationOptions& options, const Progress& progress,
                                           const ViewScore& view_score) {
  const double started = cpu_seconds();
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_ASSIGN(const PreparedCloud source, prepare(source_cloud, options, "source cloud"));
  ORBITFUSE_ASSIGN(const PreparedCloud target, prepare(target_cloud, options, "target cloud"));
  ORBITFUSE_TRY(progress.check("registration"));
  const Search search(source, target, options);
  ORBITFUSE_ASSIGN(Found found, search_all(search, progress));
  if (found.ranked.empty()) {
    return fail(ErrorKind::quality, "registration", "no placement brings the clouds together",
                "check that both clouds show the same object");
  }
  std::vector<RegistrationAlternative> judged;
  for (const Candidate& c : found.ranked) {
    RegistrationAlternative a;
    a.target_from_source = target.unit_from_cloud.inverse() * c.target_from_source * source.unit_from_cloud;
    a.score = c.agreement;
    a.evidence = c.score;
    a.origin = c.origin;
    judged.push_back(std::move(a));
  }
  const double most = judged[0].evidence;
  std::size_t rivals = 1;
  while (rivals < judged.size() && judged[rivals].evidence >= options.ambiguity_ratio * most) ++rivals;
  std::size_t chosen = 0;
  if (view_score && rivals > 1) {
    for (std::size_t i = 0; i < rivals; ++i) judged[i].view_score = view_score(judged[i].target_from_source);
    for (std::size_t i = 1; i < rivals; ++i) {
      if (judged[i].view_score > judged[chosen].view_score) chosen = i;
    }
  }
  RegistrationReport report = reported(search, found.ranked[chosen].target_from_source);
  report.initialiser = judged[chosen].origin;
  report.skips = std::move(found.skips);
  if (rivals > 1 && !view_score) {
    report.ambiguous = true;
    add_words(report.ambiguity, fmt::format("{} placements have {:.0f} % of the best one's evidence or more", rivals,
                                            100 * options.ambiguity_ratio));
  }
  judged.erase(judged.begin() + static_cast<std::ptrdiff_t>(chosen));
  report.alternatives = std::move(judged);
  report.cpu_s = cpu_seconds() - started;
  return report;
}

Result<RegistrationReport> refine_registration(const PointCloud& source_cloud, const PointCloud& target_cloud,
                                               const Similarity3d& start, const RegistrationOptions& options) {
  const double started = cpu_seconds();
  ORBITFUSE_TRY(options.validate());
  if (!start.is_finite() || !(start.scale > 0)) {
    return fail(ErrorKind::usage, "start", "a similarity that is not finite or has no scale", "give a finite one");
  }
  ORBITFUSE_ASSIGN(const PreparedCloud source, prepare(source_cloud, options, "source cloud"));
  ORBITFUSE_ASSIGN(const PreparedCloud target, prepare(target_cloud, options, "target cloud"));
  const Search search(source, target, options);
  const Similarity3d unit_start = target.unit_from_cloud * start * source.unit_from_cloud.inverse();
  const Similarity3d closer = search.refine_with(unit_start, 800, {0.2, 0.06, 10, 4, true, true}).target_from_source;
  RegistrationReport report = reported(search, closer);
  report.initialiser = "given start";
  report.cpu_s = cpu_seconds() - started;
  return report;
}

}  // namespace orbitfuse
