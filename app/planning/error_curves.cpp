// SPDX-License-Identifier: BSD-3-Clause
#include "app/planning/error_curves.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace orbitfuse::planning {
namespace {

/// A measured curve over the logarithm of steps, straight between its points; goes on beyond the
/// first as it begins, and stays at the last.
struct Point {
  double steps, value;
};

template <std::size_t n>
double at(const Point (&curve)[n], double steps) {
  const double x = std::log2(std::clamp(steps, 1.0, curve[n - 1].steps));
  std::size_t i = 1;
  while (i + 1 < n && x > std::log2(curve[i].steps)) ++i;
  const double x0 = std::log2(curve[i - 1].steps), x1 = std::log2(curve[i].steps);
  return curve[i - 1].value + (curve[i].value - curve[i - 1].value) * (x - x0) / (x1 - x0);
}

// Against a run without a budget: means over scenes, docs/notes/planner.md. The last point is one
// scene's step from the one before.
constexpr Point visible_gain_db[] = {{1200, -2.35}, {2400, -1.02}, {4800, 0},
                                     {9600, 0.77},  {19200, 1.25}, {38400, 1.52}};
/// Of the logarithm of the mean absolute error: more is worse, other than with gains in dB. Longer
/// trainings learn the poses' errors: twice the steps made it 3 % larger. The last point was not
/// measured: it lets a plan with time to spare take a quarter more steps, and no more.
constexpr Point thermal_log_error[] = {{600, 0.31}, {1200, 0.11}, {2400, 0}, {3000, -0.01}};
/// What a weaker visible field costs the thermal one: its geometry, and the poses found with it.
constexpr Point thermal_log_error_of_guide[] = {{1200, 0.13}, {4800, 0}};
/// New views without the recorded ones' detail, which fields' own errors don't have: means of seven
/// scenes (docs/benchmarks/nerf_detail.md).
constexpr double no_detail_db = -1.38, no_detail_log_k = 0.13;

// Thermal views may lose their places in a weak visible field: a risk, which a plan keeps away from
// while anything else fits, but no error to expect. Log errors as above, chosen, not measured.
constexpr Point risk_of_weak_guide[] = {{1200, 0.12}, {2400, 0.05}, {4800, 0}};

/// A little beyond what is known of the scenes it was fitted to, 24.6 to 29.5.
constexpr double least_smooth_db = 23, most_smooth_db = 33;

/// Of held-out frames, with their noise and drift.
constexpr double usual_mae_k = 1.05, mae_spread_k = 0.35;

double log_k(const SceneFacts& facts, const Effort& effort) {
  double value = at(thermal_log_error, effort.thermal_steps);
  if (facts.visible_views > 0) value += at(thermal_log_error_of_guide, effort.visible_steps);
  return value;
}

double risk(const SceneFacts& facts, const Effort& effort) {
  if (facts.visible_views == 0 || facts.thermal_views == 0) return 0;
  return at(risk_of_weak_guide, effort.visible_steps);
}

double gain_db(const Effort& effort) { return at(visible_gain_db, effort.visible_steps); }

}  // namespace

ExpectedErrors expected_errors(const SceneFacts& facts, const Effort& effort) {
  ExpectedErrors errors;
  const double smoothness_db = std::clamp(facts.smoothness_db, least_smooth_db, most_smooth_db);
  errors.visible_psnr_db = 25.5 + 0.75 * (smoothness_db - 27.5) + gain_db(effort);
  errors.visible_spread_db = 1.9;
  errors.thermal_mae_k = usual_mae_k * std::exp(log_k(facts, effort));
  errors.thermal_spread_k = mae_spread_k * std::exp(log_k(facts, effort));
  return errors;
}

double loss(const SceneFacts& facts, const Effort& effort) {
  const bool detailed = effort.detail || facts.detail_sources == 0;
  const double lent_db = detailed ? 0 : no_detail_db, lent_log_k = detailed ? 0 : no_detail_log_k;
  const double visible = -(gain_db(effort) + lent_db) / 20 * std::log(10.0),
               thermal = log_k(facts, effort) + lent_log_k + risk(facts, effort);
  const double fields = facts.visible_views == 0   ? thermal
                        : facts.thermal_views == 0 ? visible
                                                   : (visible + thermal) / 2;
  constexpr double unscored = 0.02;  // of fused pictures: told less of, not worse
  return fields + (effort.scored_views > 0 ? unscored : 0);
}

}  // namespace orbitfuse::planning
