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
