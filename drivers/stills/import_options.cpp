// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>

#include "drivers/stills/import.hpp"

namespace orbitfuse {
namespace {

Status check(bool ok, const std::string& field, const std::string& found,
             const std::string& remedy) {
  if (ok) return {};
  return fail(ErrorKind::usage, "import." + field, found, remedy);
}

Status check_stations(const std::optional<DeclaredStations>& stations, const std::string& field) {
  if (!stations) return {};
  const DeclaredStations& s = *stations;
  ORBITFUSE_TRY(check(s.spacing_deg >= 1 && s.spacing_deg <= 180, field + ".spacing_deg",
                      fmt::format("{}", s.spacing_deg), "must be 1 to 180"));
  ORBITFUSE_TRY(check(s.loops >= 1 && s.loops <= 100, field + ".loops", fmt::format("{}", s.loops),
                      "must be 1 to 100"));
  ORBITFUSE_TRY(
      check(s.elevations_deg.empty() || static_cast<int>(s.elevations_deg.size()) == s.loops,
            field + ".elevations_deg",
            fmt::format("{} values for {} loops", s.elevations_deg.size(), s.loops),
            "give one per loop or none"));
  for (double e : s.elevations_deg) {
    ORBITFUSE_TRY(check(e >= -90 && e <= 90, field + ".elevations_deg", fmt::format("{}", e),
                        "must be -90 to 90"));
  }
  return check(s.elevation_sigma_deg > 0 && s.elevation_sigma_deg < 90,
               field + ".elevation_sigma_deg", fmt::format("{}", s.elevation_sigma_deg),
               "must be above 0 and below 90; leave the elevations out where they are unknown");
}

Status check_range(const std::optional<double>& value, double low, double high,
                   const std::string& field) {
  if (!value) return {};
  return check(*value >= low && *value <= high, field, fmt::format("{}", *value),
               fmt::format("must be {} to {}", low, high));
}

}  // namespace

Status ImportOptions::validate() const {
  ORBITFUSE_TRY(check(!visible.empty() || !thermal.empty() || transforms_json, "visible",
                      "no images given", "give --visible, --thermal or a transforms.json"));
  ORBITFUSE_TRY(check(!embedded_visible || !thermal.empty(), "embedded_visible",
                      "no thermal images given", "give the radiometric JPEGs as thermal"));
  ORBITFUSE_TRY(check(!transforms_json || (!visible_colmap && !thermal_colmap && !ground_truth),
                      "transforms_json", "given together with other poses",
                      "choose one source of poses"));
  ORBITFUSE_TRY(check(!ground_truth || (!visible_colmap && !thermal_colmap), "ground_truth",
                      "given together with a COLMAP model", "choose one source of poses"));
  ORBITFUSE_TRY(check(!visible_colmap || !thermal_colmap || *visible_colmap == *thermal_colmap,
                      "thermal_colmap", "another model than the visible one: their worlds differ",
                      "give one model of both, or only one of them"));
  ORBITFUSE_TRY(check(!ground_truth_priors_only || ground_truth, "ground_truth_priors_only",
                      "no ground truth given", "give the ground truth file"));
  ORBITFUSE_TRY(check_stations(visible_stations, "visible_stations"));
  ORBITFUSE_TRY(check_stations(thermal_stations, "thermal_stations"));
  if (thermal_scale == ThermalScale::linear) {
    ORBITFUSE_TRY(
        check(kelvin_per_count > 0 && kelvin_per_count <= 10, "kelvin_per_count",
              kelvin_per_count == 0 ? "not given" : fmt::format("{}", kelvin_per_count),
              "say how many kelvin a count is, more than 0 and at most 10 (--kelvin-per-count)"));
    ORBITFUSE_TRY(check(std::isfinite(kelvin_offset) && std::abs(kelvin_offset) <= 10000,
                        "kelvin_offset", fmt::format("{}", kelvin_offset),
                        "must be within 10000 K of zero"));
  }
  ORBITFUSE_TRY(
      check(!object.any() || !thermal.empty() || !thermal_tracking.empty() || transforms_json,
            "object", "object parameters, but no thermal files",
            "give the radiometric JPEGs as thermal, or leave it out"));
  ORBITFUSE_TRY(video.validate());
  ORBITFUSE_TRY(check_range(object.emissivity, 0.01, 1, "object.emissivity"));
  ORBITFUSE_TRY(check_range(object.distance_m, 0, 1e5, "object.distance_m"));
  ORBITFUSE_TRY(
      check_range(object.reflected_temperature_k, 1, 5000, "object.reflected_temperature_k"));
  ORBITFUSE_TRY(
      check_range(object.atmospheric_temperature_k, 150, 400, "object.atmospheric_temperature_k"));
  ORBITFUSE_TRY(check_range(object.relative_humidity, 0, 1, "object.relative_humidity"));
  ORBITFUSE_TRY(check_range(visible_focal_px, 1, 1e6, "visible_focal_px"));
  return check_range(thermal_focal_px, 1, 1e6, "thermal_focal_px");
}

}  // namespace orbitfuse
