// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/orbit_choice.hpp"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/system/trace.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// What a turn must have more than none.
constexpr double turned_ratio = 1.5, turned_lead = 2;
constexpr std::size_t looked_at = 3;

Result<OrbitChoice> searched(OrbitEvidence evidence, const Progress& progress) {
  OrbitChoice choice{std::move(evidence), {}, {}, {}, {}};
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
  double best = 0;
  for (std::size_t h = 0; h < std::min(choice.hypotheses.size(), looked_at); ++h) {
    ORBITFUSE_ASSIGN(const RenderAlignment opened, open_orbit({renderer, choice.orbit, progress},
                                                              choice.blank, choice.hypotheses[h]));
    best = std::max(best, mean_support(opened));
  }
  return best;
}

}  // namespace

double OrbitChoice::lead() const {
  return selected.lead_standard_errors.value_or(std::numeric_limits<double>::infinity());
}

bool OrbitChoice::clearly_better_than(const OrbitChoice& other) const {
  const RenderAlignment &mine = selected.alignment, &others = other.selected.alignment;
  return mean_support(mine) >= turned_ratio * mean_support(others) &&
         orbitfuse::lead_standard_errors(mine, others) >= turned_lead;
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
