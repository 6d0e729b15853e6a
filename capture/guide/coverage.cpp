// SPDX-License-Identifier: BSD-3-Clause
#include "capture/guide/coverage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/option_range.hpp"

namespace orbitfuse {
namespace {

std::string sideways(double degrees) {
  // Azimuth grows counter-clockwise seen from above; facing the object that is to the right.
  return fmt::format("{:.0f}° further {}", std::abs(degrees), degrees > 0 ? "right" : "left");
}

std::string upwards(double degrees) {
  return fmt::format("{:.0f}° {}", std::abs(degrees), degrees > 0 ? "higher" : "lower");
}

}  // namespace

double angle_difference_deg(double a_deg, double b_deg) {
  const double wrapped = std::fmod(a_deg - b_deg + 180.0, 360.0);
  return (wrapped < 0 ? wrapped + 360.0 : wrapped) - 180.0;
}

int OrbitPlan::sectors_per_loop() const {
  return static_cast<int>(std::lround(360.0 / spacing_deg));
}

Status OrbitPlan::validate() const {
  const OptionCheck check("guide");
  ORBITFUSE_TRY(check("spacing_deg", spacing_deg, from_to(1, 120)));
  const double count = 360.0 / spacing_deg;
  if (std::abs(count - std::round(count)) > 1e-9)
    return fail(ErrorKind::usage, "guide.spacing_deg", fmt::format("{}", spacing_deg),
                "must divide 360");
  ORBITFUSE_TRY(
      check("azimuth_tolerance_deg", azimuth_tolerance_deg, above_up_to(0, spacing_deg / 2)));
  ORBITFUSE_TRY(check("elevation_tolerance_deg", elevation_tolerance_deg, above(0)));
  const auto none = [](const char* field) {
    return fail(ErrorKind::usage, field, "none", "give at least one");
  };
  if (loop_elevations_deg.empty()) return none("guide.loop_elevations_deg");
  for (const double elevation : loop_elevations_deg)
    ORBITFUSE_TRY(check("loop_elevations_deg", elevation, between(-90, 90)));
  std::vector<double> sorted = loop_elevations_deg;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i] - sorted[i - 1] < 2 * elevation_tolerance_deg)
      return fail(ErrorKind::usage, "guide.loop_elevations_deg", fmt::format("{}", sorted[i]),
                  fmt::format("loops must be {:g} degrees apart or more, or a frame fits both",
                              2 * elevation_tolerance_deg));
  }
  if (modalities.empty()) return none("guide.modalities");
  return {};
}

Status CoverageOptions::validate() const {
  const OptionCheck check("guide");
  ORBITFUSE_TRY(check("min_sharpness", min_sharpness, above_up_to(0, 1)));
  ORBITFUSE_TRY(check("max_visible_edge_px", max_visible_edge_px, above(0)));
  ORBITFUSE_TRY(check("max_thermal_edge_px", max_thermal_edge_px, above(0)));
  ORBITFUSE_TRY(check("max_clipped", max_clipped, above_up_to(0, 1)));
  ORBITFUSE_TRY(check("rest_speed_deg_s", rest_speed_deg_s, above(0)));
  return check("max_sigma_deg", max_sigma_deg, above(0));
}

std::string text(Refusal refusal) {
  switch (refusal) {
    case Refusal::none:
      return "good";
    case Refusal::not_on_disk:
      return "not saved";
    case Refusal::lost:
      return "the mat is out of sight";
    case Refusal::nuc:
      return "the camera is correcting itself, wait";
    case Refusal::moving:
      return "too fast, hold still";
    case Refusal::blurred:
      return "blurred, hold still";
    case Refusal::featureless:
      return "nothing to see, aim at the object and focus";
    case Refusal::badly_exposed:
      return "too dark or too bright";
    case Refusal::position_unsure:
      return "position unsure, look at the mat";
    case Refusal::between_stations:
      return "between stations";
    case Refusal::out_of_band:
      return "too high or too low";
  }
  return "";
}

Coverage::Coverage(OrbitPlan plan, CoverageOptions options)
    : plan_(std::move(plan)), options_(options) {
  assert(plan_.validate() && options_.validate());
  for (std::size_t loop = 0; loop < plan_.loop_elevations_deg.size(); ++loop) {
    for (int i = 0; i < plan_.sectors_per_loop(); ++i) {
      sectors_.push_back(
          {static_cast<int>(loop), i, i * plan_.spacing_deg, plan_.loop_elevations_deg[loop]});
    }
  }
}

Refusal Coverage::add(const FrameAssessment& frame) {
  if (frame.file.empty()) return Refusal::not_on_disk;
  if (frame.nuc) return Refusal::nuc;
  if (!frame.position) return Refusal::lost;
  const OrbitPosition& p = *frame.position;
  // Negated comparisons, so that NaN refuses.
  if (!(p.sigma_deg <= options_.max_sigma_deg)) return Refusal::position_unsure;
  if (!(std::abs(p.speed_deg_s) <= options_.rest_speed_deg_s)) return Refusal::moving;
  // Exposure first: what is too dark has no edges either.
  if (!(std::max(frame.overexposed, frame.underexposed) <= options_.max_clipped))
    return Refusal::badly_exposed;
  if (frame.edge_blur && frame.edge_blur->edges == 0) return Refusal::featureless;
  if (!(frame.sharpness >= options_.min_sharpness)) return Refusal::blurred;
  if (frame.edge_blur) {
    const double widest = frame.modality == Modality::visible ? options_.max_visible_edge_px
                                                              : options_.max_thermal_edge_px;
    if (!(frame.edge_blur->sigma_px <= widest)) return Refusal::blurred;
  }
  bool in_band = false;
  for (Sector& sector : sectors_) {
    if (!(std::abs(p.elevation_deg - sector.elevation_deg) <= plan_.elevation_tolerance_deg))
      continue;
    in_band = true;
    if (!(std::abs(angle_difference_deg(p.azimuth_deg, sector.azimuth_deg)) <=
          plan_.azimuth_tolerance_deg))
      continue;
    const double rank = frame.rank.value_or(frame.sharpness);
    const auto before = sector.best.find(frame.modality);
    if (before == sector.best.end() || rank > before->second.rank)
      sector.best[frame.modality] = {frame.file, rank};
    return Refusal::none;
  }
  return in_band ? Refusal::between_stations : Refusal::out_of_band;
}

int Coverage::done_count(Modality modality) const {
  return static_cast<int>(std::count_if(sectors_.begin(), sectors_.end(),
                                        [&](const Sector& s) { return s.done(modality); }));
}

bool Coverage::complete() const {
  return std::all_of(plan_.modalities.begin(), plan_.modalities.end(),
                     [&](Modality m) { return missing(m).empty(); });
}

std::vector<const Sector*> Coverage::missing(Modality modality) const {
  std::vector<const Sector*> list;
  for (const Sector& sector : sectors_) {
    if (!sector.done(modality)) list.push_back(&sector);
  }
  return list;
}

/// Nearest on foot: a change of loop costs the operator more than a few steps, so it counts double.
const Sector* Coverage::nearest_missing(Modality modality, const OrbitPosition& now) const {
  const Sector* best = nullptr;
  double best_cost = 0;
  for (const Sector* sector : missing(modality)) {
    const double cost = std::abs(angle_difference_deg(sector->azimuth_deg, now.azimuth_deg)) +
                        2 * std::max(0.0, std::abs(sector->elevation_deg - now.elevation_deg) -
                                              plan_.elevation_tolerance_deg);
    if (!best || cost < best_cost) {
      best = sector;
      best_cost = cost;
    }
  }
  return best;
}

const Sector* Coverage::target(Modality modality, const std::optional<OrbitPosition>& now) const {
  if (now) return nearest_missing(modality, *now);
  const std::vector<const Sector*> list = missing(modality);
  return list.empty() ? nullptr : list.front();
}

std::string Coverage::instruction(Modality modality, const std::optional<OrbitPosition>& now,
                                  Refusal last) const {
  const int left = static_cast<int>(missing(modality).size());
  if (left == 0) return fmt::format("{}: done", name(modality));
  if (!now) return "show the mat to the camera";
  const Sector* target = nearest_missing(modality, *now);
  const double turn = angle_difference_deg(target->azimuth_deg, now->azimuth_deg);
  const double climb = target->elevation_deg - now->elevation_deg;
  const bool there = std::abs(turn) <= plan_.azimuth_tolerance_deg;
  const bool in_band = std::abs(climb) <= plan_.elevation_tolerance_deg;
  if (there && in_band) {
    const bool fixable =
        last != Refusal::none && last != Refusal::between_stations && last != Refusal::out_of_band;
    return fixable ? text(last) : "hold still";
  }
  std::string words;
  if (!there) words = sideways(turn);
  if (!in_band) words += (words.empty() ? "" : ", ") + upwards(climb);
  return words;
}

}  // namespace orbitfuse
