// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/orbit_choice.hpp"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/system/trace.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// What a turn must have more than none. One of four is best by chance, hence three errors.
constexpr double turned_ratio = 1.5, turned_lead = 3;
/// Support of the right start's views after their first correction, by that of the best other
/// start: 7 to 26 on seven scenes; those below 10 led by 2.4 times or more.
constexpr double weak_opening = 10, contested_lead = 2;
/// A start beside that is right: 18.8 for 7.6; beside right ones 9.9 for 9.1 at most.
constexpr double clearly_better_opening = 1.3;
/// First looks at a turn; of few views the right start comes late.
constexpr std::size_t looked_at = 3;

/// Renders are compared at one width, so that a view has the more of its patches the narrower its
/// image is.
double support_scale(const OrbitEvidence& evidence) {
  const Camera& taken = evidence.lens.camera;
  const double ratio = static_cast<double>(upright(evidence.turn, taken).width) / taken.width;
  return ratio * ratio;
}

Result<OrbitChoice> searched(OrbitEvidence evidence, const Progress& progress) {
  OrbitChoice choice{std::move(evidence)};
  ORBITFUSE_ASSIGN(choice.hypotheses, search(choice.evidence, progress));
  choice.orbit.images = choice.evidence.images;
  choice.orbit.canonical_from_world = choice.evidence.canonical_from_visible;
  choice.orbit.assumed = !all_have_stations(choice.evidence.frames);
  choice.blank = blank_views(choice.evidence);
  return choice;
}

Status select(const SceneRenderer& renderer, const Progress& progress, OrbitChoice& choice) {
  ORBITFUSE_ASSIGN(choice.selected, select_by_renders(renderer, choice.orbit, choice.blank,
                                                      choice.hypotheses, progress));
  return {};
}

/// The same walk, begun so much later: each view where its loop then has it.
OrbitHypothesis begun_later(const OrbitHypothesis& hypothesis, double by_deg) {
  OrbitHypothesis later = hypothesis;
  later.offset_deg += by_deg;
  for (OrbitPose& pose : later.nominal) pose.azimuth_deg += by_deg;
  later.poses = later.nominal;
  for (std::size_t i = 0; i < later.poses.size(); ++i) later.starts[i] = {later.poses[i]};
  return later;
}

/// Cameras that were held askew blur the score of starts. Renders, which turn with each view, tell
/// those beside the best apart: the one that they like clearly better is asked as well.
Status try_starts_beside(const SceneRenderer& renderer, const Progress& progress,
                         OrbitChoice& choice) {
  const OrbitHypothesis best = choice.hypotheses[choice.selected.hypothesis];
  double most = clearly_better_opening * mean_support(choice.selected.opening);
  std::optional<OrbitHypothesis> better;
  for (const double by_deg : {-24.0, -16.0, -8.0, 8.0, 16.0, 24.0}) {
    OrbitHypothesis later = begun_later(best, by_deg);
    ORBITFUSE_ASSIGN(const RenderAlignment opened,
                     open_orbit({renderer, choice.orbit, progress}, choice.blank, later));
    if (mean_support(opened) <= most) continue;
    most = mean_support(opened);
    better = std::move(later);
  }
  if (!better) return {};
  choice.hypotheses.push_back(*std::move(better));
  return select(renderer, progress, choice);
}

/// Support of the hypotheses that the lines like best, at a first look.
Result<double> first_look(const SceneRenderer& renderer, OrbitChoice& choice,
                          const Progress& progress) {
  const bool few = choice.blank.size() < few_views;
  const std::size_t looks = few ? choice.hypotheses.size() : looked_at;
  double best = 0;
  for (std::size_t h = 0; h < std::min(choice.hypotheses.size(), looks); ++h) {
    ORBITFUSE_ASSIGN(const RenderAlignment opened, open_orbit({renderer, choice.orbit, progress},
                                                              choice.blank, choice.hypotheses[h]));
    best = std::max(best, mean_support(opened));
  }
  return best * support_scale(choice.evidence);
}

std::vector<double> supports(const OrbitChoice& choice) {
  std::vector<double> result = supports_of(choice.selected.alignment);
  for (double& one : result) one *= support_scale(choice.evidence);
  return result;
}

}  // namespace

double OrbitChoice::lead() const {
  return selected.lead_standard_errors.value_or(std::numeric_limits<double>::infinity());
}

double OrbitChoice::support() const {
  return mean_support(selected.alignment) * support_scale(evidence);
}

bool OrbitChoice::clearly_better_than(const OrbitChoice& other) const {
  return support() >= turned_ratio * other.support() &&
         lead_standard_errors(supports(*this), supports(other)) >= turned_lead;
}

Result<OrbitChoice> choose_orbit(const SceneRenderer& renderer, const OrbitEvidence& evidence,
                                 const Progress& progress) {
  ORBITFUSE_ASSIGN(OrbitChoice choice, searched(evidence, progress));
  ORBITFUSE_TRY(select(renderer, progress, choice));
  const double opening = mean_support(choice.selected.opening) * support_scale(choice.evidence);
  if (opening < weak_opening && choice.selected.opening_lead < contested_lead)
    ORBITFUSE_TRY(try_starts_beside(renderer, progress, choice));
  return choice;
}

Result<OrbitChoice> choose_turned_orbit(const SceneRenderer& renderer,
                                        const OrbitEvidence& evidence, const Progress& progress) {
  const TraceSpan span("turned views");
  std::optional<OrbitChoice> best;
  double best_look = -1;
  for (const int quarters : {2, 1, 3}) {
    ORBITFUSE_ASSIGN(OrbitChoice choice, searched(turned(evidence, {quarters}), progress));
    ORBITFUSE_ASSIGN(const double look, first_look(renderer, choice, progress));
    if (look <= best_look) continue;
    best_look = look;
    best = std::move(choice);
  }
  ORBITFUSE_TRY(select(renderer, progress, *best));
  return *std::move(best);
}

}  // namespace orbitfuse
