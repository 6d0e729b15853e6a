// SPDX-License-Identifier: BSD-3-Clause
#include "app/planning/plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace orbitfuse::planning {
namespace {

/// Beyond these the measured curves are flat.
constexpr int most_visible_steps = 38'400, most_thermal_steps = 3'000;
constexpr int lengths = 300;  // of the visible training that are tried

bool comes(const std::vector<std::string>& stages, const char* stage) {
  return std::find(stages.begin(), stages.end(), stage) != stages.end();
}

double seconds(const SceneFacts& facts, const std::vector<std::string>& stages, double slowness,
               const Effort& effort) {
  double sum = 0;
  for (const std::string& stage : stages) sum += stage_s(stage, facts, effort);
  return slowness * sum;
}

template <class Value>
std::vector<Value> choices(const std::optional<Value>& settled, const std::vector<Value>& all) {
  return settled ? std::vector<Value>{*settled} : all;
}

/// Steps that `time_s` pays for, within what makes sense.
int steps_for(double time_s, double step_s, int least, int most) {
  return static_cast<int>(std::clamp(time_s / step_s, 1.0 * least, 1.0 * most));
}

/// Lengths of the visible training, from the least to the most, i = 0..lengths.
int visible_steps_at(int i) {
  return static_cast<int>(std::lround(
      least_effort.visible_steps * std::pow(1.0 * most_visible_steps / least_effort.visible_steps,
                                            static_cast<double>(i) / lengths)));
}

struct Search {
  const SceneFacts& facts;
  const std::vector<std::string>& stages;
  const Settled& settled;
  double slowness, available_s;
  Plan best;
  double best_loss = std::numeric_limits<double>::infinity();

  bool trains(Modality modality) const {
    return modality == Modality::visible
               ? facts.visible_views > 0 && comes(stages, "train_visible")
               : facts.thermal_views > 0 && comes(stages, "train_thermal");
  }

  void consider(Effort effort) {
    const double needed_s = seconds(facts, stages, slowness, effort);
    if (needed_s > available_s) return;
    const double now = loss(facts, effort);
    if (now >= best_loss) return;
    best_loss = now;
    best.effort = effort;
    best.expected_s = needed_s;
  }

  /// Every length of the visible training, and what it leaves for the thermal one.
  void divide(Effort effort) {
    const bool visible = trains(Modality::visible) && !settled.visible_steps,
               thermal = trains(Modality::thermal) && !settled.thermal_steps;
    for (int i = 0; i <= (visible ? lengths : 0); ++i) {
      if (visible) effort.visible_steps = visible_steps_at(i);
      if (thermal) {
        effort.thermal_steps = 0;
        const double left_s = available_s - seconds(facts, stages, slowness, effort);
        effort.thermal_steps = steps_for(left_s / slowness, thermal_step_s(),
                                         least_effort.thermal_steps, most_thermal_steps);
      }
      consider(effort);
    }
  }

  /// The soonest end there is: with a weak visible field the stages behind it can take longer than
  /// its training saves.
  Effort soonest(Effort least) const {
    if (!trains(Modality::visible) || settled.visible_steps) return least;
    Effort best_one = least;
    for (int i = 0; i <= lengths; ++i) {
      least.visible_steps = visible_steps_at(i);
      if (seconds(facts, stages, slowness, least) < seconds(facts, stages, slowness, best_one))
        best_one = least;
    }
    return best_one;
  }
};

}  // namespace

Plan make_plan(const SceneFacts& facts, const std::vector<std::string>& stages,
               const Settled& settled, double slowness, double available_s) {
  Effort least = least_effort;
  least.visible_steps = settled.visible_steps.value_or(least.visible_steps);
  least.thermal_steps = settled.thermal_steps.value_or(least.thermal_steps);
  least.detail = settled.detail.value_or(least.detail);
  least.scored_views = settled.scored_views.value_or(least.scored_views);

  Search search{facts, stages, settled, slowness, available_s, {}};
  const Effort usual;
  Effort effort = least;
  for (const int scored :
       choices(settled.scored_views, {usual.scored_views, least_effort.scored_views}))
    for (const bool detail : choices(settled.detail, {true, false})) {
      effort.scored_views = scored;
      effort.detail = detail;
      search.divide(effort);
    }
  if (!std::isfinite(search.best_loss)) {
    search.best.effort = search.soonest(least);
    search.best.expected_s = seconds(facts, stages, slowness, search.best.effort);
    search.best.fits = false;
  } else {
    const double spare_s = available_s - search.best.expected_s;
    search.best.all_used = spare_s <= 0.05 * available_s;
  }
  return search.best;
}

}  // namespace orbitfuse::planning
