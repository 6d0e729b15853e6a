// SPDX-License-Identifier: BSD-3-Clause
#include "app/planning/stage_costs.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "app/stages/build_stages.hpp"
#include "app/stages/recorded_detail.hpp"

namespace orbitfuse::planning {
namespace {

// Seconds on two cores of an Intel Xeon (Sapphire Rapids), from the traces of whole runs
// (`run --trace`, docs/notes/planner.md); all but steps, fusion and the report from runs on an AMD
// EPYC, 2026-11-28 (visible poses the day before), by its slowness of 1.27.
/// Known poses are held against the images: 2.5 s each for 24 views.
constexpr double start_s = 0.3, known_pose_s = 0.1;
constexpr double visible_pose_s =
    0.3;  // a view: features, matching, mapping; 0.15 to 0.45 by scene, 1.4 where texture is faint
/// A view: search, renders, temperatures. 0.75 to 1.05 by scene; what is wrong is made good later,
/// by the thermal training and the scores.
constexpr double thermal_pose_s = 0.88;
constexpr double depth_view_s = 0.35;  // of 400 x 300 pixels
constexpr double visible_step = 2.85e-3, thermal_step = 3.5e-3;
constexpr double visible_view_s = 0.12;  // its image, its exposure, its part of the cloud
constexpr double thermal_view_s = 0.07;
constexpr double visible_checks_s = 0.5, thermal_checks_s = 1.1;  // of held-out views
constexpr double new_view_mpx_s = 2.7;                            // both fields
constexpr double lent_view_s = 0.02;  // a recorded view that lends detail; its cloud has the render
constexpr double fused_mpx_s = 0.115;  // a method
constexpr double scored_mpx_s = 0.265, heldout_view_s = 0.25;
constexpr int heldout_every = 12;
constexpr double report_s = 0.5;
constexpr double thermal_depth_view_s = 0.13;  // without photos: matched at 260 pixels
constexpr double clouds_s = 5;                 // two frames of their own are registered
constexpr double usual_steps = 4800, halvings_at_900 = 2.4, fog_power = 1.4;
constexpr double thermal_pose_fog = 1.7, render_fog = 1.75;
/// Depth at 200 pixels takes more than a quarter: planes are drawn at half width in any case.
constexpr double depth_power = 1.7;

/// A field that has learnt little is fog: its renders take longer, and thermal views that are
/// placed by them are searched longer. Seconds against those with the usual field.
double fog(const SceneFacts& facts, const Effort& effort, double at_900_steps) {
  if (facts.visible_views == 0 || effort.visible_steps >= usual_steps) return 1;
  const double halvings = std::log2(usual_steps / std::max(1.0, 1.0 * effort.visible_steps));
  return 1 + (at_900_steps - 1) * std::pow(halvings / halvings_at_900, fog_power);
}

}  // namespace

double visible_step_s() { return visible_step; }
double thermal_step_s() { return thermal_step; }

double stage_s(const std::string& stage, const SceneFacts& facts, const Effort& effort) {
  const double photos = facts.visible_views, thermal = facts.thermal_views;
  const bool both = photos > 0 && thermal > 0;
  if (stage == "report") return report_s;
  if (stage == "register") return both && facts.visible_posed && facts.thermal_posed ? clouds_s : 0;
  if (stage == "render") {
    const int sources = effort.detail ? facts.detail_sources : 0;
    const double asked = (facts.new_views + 1.0 * stages::detail_trials) * sources;
    const double lent = std::min(asked, photos) + std::min(asked, thermal);
    return start_s + (facts.new_views * facts.new_view_mpx * new_view_mpx_s * (both ? 1 : 0.5) +
                      lent * lent_view_s) *
                         fog(facts, effort, render_fog);
  }
  if (stage == "fuse")
    return both ? facts.new_views * facts.new_view_mpx * facts.fusion_methods * fused_mpx_s : 0;
  if (stage == "metrics") {
    const int scored =
        effort.scored_views > 0 ? std::min(effort.scored_views, facts.new_views) : facts.new_views;
    // What recorded views lend to held-out ones was rendered for the new views already (not where
    // a run goes on behind them: some seconds that no plan knows of).
    const double heldout =
        heldout_view_s * (std::ceil(photos / heldout_every) + std::ceil(thermal / heldout_every));
    return heldout + (both ? scored * facts.new_view_mpx * facts.fusion_methods * scored_mpx_s : 0);
  }
  if (photos > 0) {
    if (stage == "poses_visible")
      return start_s + photos * (facts.visible_posed ? known_pose_s : visible_pose_s);
    if (stage == "depth")
      return start_s + photos * depth_view_s * facts.visible_height_by_width / 0.75 *
                           std::pow(facts.depth_width_px / 400.0, depth_power);
    if (stage == "train_visible")
      return start_s + photos * visible_view_s + visible_checks_s +
             effort.visible_steps * visible_step;
  }
  if (thermal > 0) {
    if (stage == "poses_thermal")
      return start_s + thermal * (facts.thermal_posed
                                      ? known_pose_s
                                      : thermal_pose_s * fog(facts, effort, thermal_pose_fog));
    if (stage == "train_thermal")
      return start_s + thermal * (thermal_view_s + (photos > 0 ? 0 : thermal_depth_view_s)) +
             thermal_checks_s + effort.thermal_steps * thermal_step;
  }
  const std::vector<std::string>& known = stages::stage_names();
  assert(std::find(known.begin(), known.end(), stage) != known.end());
  (void)known;
  return 0;
}

}  // namespace orbitfuse::planning
