// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/register.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/numeric/random.hpp"
#include "core/system/clock.hpp"
#include "recon/registration/clouds/ambiguity.hpp"
#include "recon/registration/clouds/search.hpp"
#include "recon/registration/clouds/warp.hpp"

namespace orbitfuse {
namespace registration {
namespace {

/// How far each of a start's seven parameters is disturbed, either way: radians (2 degrees), logs
/// of the scale, radii. Far enough that the refinement has to find its way back, near enough that
/// it should.
constexpr double most_kick = 0.035;
/// A disturbed start is near: bounds begin not much wider than they end.
constexpr RefineOptions restart_refinement{
    .start_bound = 0.12, .end_bound = 0.06, .iterations = 6, .polish = 4};
/// Points of a cloud: a spread needs no more, and there are several restarts.
constexpr int restart_points = 600;
/// A given start lies within several degrees and percent.
constexpr RefineOptions given_start_refinement{
    .start_bound = 0.2, .end_bound = 0.06, .iterations = 10, .polish = 4};
/// To come near only: the last refinement takes all.
constexpr int given_start_points = 800;
/// The answer's, from a start that is already refined.
constexpr RefineOptions last_refinement{
    .start_bound = 0.10, .end_bound = 0.06, .iterations = 5, .polish = 20};

// Right placements stay above these but for clouds that are mostly outliers.
constexpr double weak_score = 0.25, weak_evidence = 0.04;
/// Of the best one's view score, by which it must lead (ViewScore): less decides wrongly more
/// often, more leaves more to the user. How often on real pairs isn't measured (docs/benchmarks/).
constexpr double decisive_lead = 0.1;
/// Of a cloud, in its unit frame.
constexpr double unit_diameter = 2;

void widen_spread(const Similarity3d& answer, const Similarity3d& other,
                  RegistrationReport& report) {
  const auto widen = [](double& spread, double by) { spread = std::max(spread, by); };
  widen(report.spread_rotation_deg, rotation_angle_deg(other.rotation, answer.rotation));
  widen(report.spread_scale_percent, 100 * std::abs(std::log(other.scale / answer.scale)));
  widen(report.spread_translation_percent,
        100 / unit_diameter * (other.translation - answer.translation).norm());
}

/// Restarts estimate no warp, so that where one was left out the spread says what that changed.
void measure_spread(const Search& search, const Similarity3d& answer,
                    const Similarity3d& without_warp, RegistrationReport& report) {
  widen_spread(answer, without_warp, report);
  for (int i = 0; i < search.options.restarts; ++i) {
    Vector7 kick;
    for (int k = 0; k < kick.size(); ++k) {
      const double unit = random_uniform(search.options.seed, static_cast<std::uint64_t>(i),
                                         static_cast<std::uint64_t>(k));
      kick[k] = most_kick * (2 * unit - 1);
    }
    const Similarity3d start = updated(without_warp, without_warp.translation, kick);
    widen_spread(answer,
                 search.refine_with(start, restart_points, restart_refinement).target_from_source,
                 report);
  }
}

/// Whether views prefer the chosen of the first `rivals` by the decisive lead or more.
bool stands_out(const std::vector<RegistrationAlternative>& judged, std::size_t chosen,
                std::size_t rivals) {
  const double best = judged[chosen].view_score;
  for (std::size_t i = 0; i < rivals; ++i) {
    if (i != chosen && !(judged[i].view_score < best - decisive_lead * std::abs(best)))
      return false;
  }
  return true;
}

void doubt(RegistrationReport& report, const std::string& why) {
  report.ambiguous = true;
  if (!report.ambiguity.empty()) report.ambiguity += "; ";
  report.ambiguity += why;
}

/// The placement beside a smooth warp, and what the report says about that.
Similarity3d beside_warp(const Search& search, const Refined& plain, RegistrationReport& report) {
  const char* const what = "smooth warp beside the similarity";
  const Unwarped unwarped = refine_beside_warp(search.source, search.target, plain, {});
  report.warp = unwarped.outcome;
  // Of three coordinates together.
  report.warp_percent_of_diameter = 100 * std::sqrt(3.0) * unwarped.amplitude / unit_diameter;
  switch (unwarped.outcome) {
    case WarpOutcome::not_asked:
    case WarpOutcome::found:
      break;
    case WarpOutcome::too_little:
      report.skips.push_back(
          {what, "too few points of the clouds lie beside each other", "a warp would not be seen"});
      break;
    case WarpOutcome::none:
      report.skips.push_back({what, "the residuals show none", "saved its refinement"});
      break;
    case WarpOutcome::at_limit:
      doubt(report, fmt::format("the clouds are bent against each other by {:.1f} % of the "
                                "diameter or more, so they may not show the same shape",
                                report.warp_percent_of_diameter));
      break;
    case WarpOutcome::diverged:
      report.skips.push_back({what,
                              "one shows, but estimating it led away from where the clouds fit",
                              "saved nothing; the answer is the one without it"});
      doubt(report,
            "the clouds are bent against each other, and where they belong without the bend could "
            "not be found");
      break;
  }
  return unwarped.target_from_source;
}

/// Last refinement on all points and everything the report says about the result.
RegistrationReport reported(const Search& search, const Similarity3d& start) {
  const Refined plain = search.refine_with(start, all_points, last_refinement);
  Refined best = plain;
  RegistrationReport report;
  if (search.options.estimate_warp) {
    const Similarity3d beside = beside_warp(search, plain, report);
    if (report.warp_percent_of_diameter > 0)
      best = search.measured_at(beside, all_points, last_refinement);
  }
  const Similarity3d target_from_unit = search.target.unit_from_cloud.inverse();
  report.target_from_source =
      target_from_unit * best.target_from_source * search.source.unit_from_cloud;
  report.score = search.agree(best.target_from_source, all_points, search.fine).score;
  report.evidence =
      search.agree(best.target_from_source, all_points, search.strict(best.residual_sigma))
          .evidence;
  const MatchFigures matched = match_figures(search.source, search.target, best.target_from_source,
                                             unit_diameter * search.options.inlier_distance);
  const MatchFigures near = match_figures(search.source, search.target, best.target_from_source,
                                          unit_diameter * search.options.max_pair_distance);
  report.matching_ratio = matched.source_share;
  report.rmse = matched.rmse * target_from_unit.scale;
  report.rmse_percent_of_diameter = 100 * matched.rmse / unit_diameter;
  report.overlap_source = near.source_share;
  report.overlap_target = near.target_share;
  measure_spread(search, best.target_from_source, plain.target_from_source, report);
  if (const std::string open = open_directions(best.hessian); !open.empty())
    doubt(report, "the shape leaves open: " + open);
  if (report.score < weak_score || report.evidence < weak_evidence) {
    doubt(report, fmt::format("the clouds support it weakly (score {:.2f}, evidence {:.2f})",
                              report.score, report.evidence));
  }
  return report;
}

}  // namespace
}  // namespace registration

using namespace registration;

Result<RegistrationReport> register_clouds(const PointCloud& source_cloud,
                                           const PointCloud& target_cloud,
                                           const RegistrationOptions& options,
                                           const Progress& progress, const ViewScore& view_score) {
  const double started = cpu_seconds();
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_ASSIGN(const PreparedCloud source, prepare(source_cloud, options, "source cloud"));
  ORBITFUSE_ASSIGN(const PreparedCloud target, prepare(target_cloud, options, "target cloud"));
  ORBITFUSE_TRY(progress.check("registration"));
  const Search search(source, target, options);
  ORBITFUSE_ASSIGN(Found found, find_placements(search, progress));
  if (found.ranked.empty()) {
    return fail(ErrorKind::quality, "registration", "no placement brings the clouds together",
                "check that both clouds show the same object");
  }
  std::vector<RegistrationAlternative> judged;
  for (const Candidate& c : found.ranked) {
    RegistrationAlternative a;
    a.target_from_source =
        target.unit_from_cloud.inverse() * c.target_from_source * source.unit_from_cloud;
    a.score = c.agreement;
    a.evidence = c.score;
    a.origin = c.origin;
    judged.push_back(std::move(a));
  }
  const double most = judged[0].evidence;
  std::size_t rivals = 1;
  while (rivals < judged.size() && judged[rivals].evidence >= options.ambiguity_ratio * most)
    ++rivals;
  std::size_t chosen = 0;
  if (view_score && rivals > 1) {
    for (std::size_t i = 0; i < rivals; ++i)
      judged[i].view_score = view_score(judged[i].target_from_source);
    for (std::size_t i = 1; i < rivals; ++i) {
      if (judged[i].view_score > judged[chosen].view_score) chosen = i;
    }
  }
  RegistrationReport report = reported(search, found.ranked[chosen].target_from_source);
  report.initialiser = judged[chosen].origin;
  report.view_score = judged[chosen].view_score;
  report.decided_by_views = view_score && rivals > 1 && stands_out(judged, chosen, rivals);
  report.skips.insert(report.skips.begin(), std::make_move_iterator(found.skips.begin()),
                      std::make_move_iterator(found.skips.end()));
  if (view_score && rivals == 1) {
    report.skips.push_back({"views of the candidates", "geometry leaves one placement",
                            "no renders of the scene from rival placements"});
  }
  if (rivals > 1 && !report.decided_by_views) {
    doubt(report, fmt::format("{} placements have {:.0f} % of the best one's evidence or more{}",
                              rivals, 100 * options.ambiguity_ratio,
                              view_score ? ", and views of both do not decide between them" : ""));
  }
  judged.erase(judged.begin() + static_cast<std::ptrdiff_t>(chosen));
  report.alternatives = std::move(judged);
  report.cpu_s = cpu_seconds() - started;
  return report;
}

Result<RegistrationReport> refine_registration(const PointCloud& source_cloud,
                                               const PointCloud& target_cloud,
                                               const Similarity3d& start,
                                               const RegistrationOptions& options) {
  const double started = cpu_seconds();
  ORBITFUSE_TRY(options.validate());
  if (!start.is_finite() || !(start.scale > 0)) {
    return fail(ErrorKind::usage, "start", "a similarity that is not finite or has no scale",
                "give a finite one");
  }
  ORBITFUSE_ASSIGN(const PreparedCloud source, prepare(source_cloud, options, "source cloud"));
  ORBITFUSE_ASSIGN(const PreparedCloud target, prepare(target_cloud, options, "target cloud"));
  const Search search(source, target, options);
  const Similarity3d unit_start = target.unit_from_cloud * start * source.unit_from_cloud.inverse();
  const Similarity3d closer =
      search.refine_with(unit_start, given_start_points, given_start_refinement).target_from_source;
  RegistrationReport report = reported(search, closer);
  report.initialiser = "given start";
  report.cpu_s = cpu_seconds() - started;
  return report;
}

}  // namespace orbitfuse
