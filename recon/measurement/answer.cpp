// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/answer.hpp"

#include <fmt/format.h>
#include <algorithm>

#include <cmath>
#include <numbers>
#include <tuple>

namespace orbitfuse::measurement {
namespace {
using nlohmann::json;

/// NaN is no number of JSON: null.
json json_of(double value) { return std::isfinite(value) ? json(value) : json(); }
json json_of(const Eigen::Vector3d& v) { return {json_of(v.x()), json_of(v.y()), json_of(v.z())}; }

json json_of(const FrameLine& line) {
  return {{"frame", line.frame},
          {"u", json_of(line.pixel.x())},
          {"v", json_of(line.pixel.y())},
          {"mean_k", json_of(line.mean_k)},
          {"min_k", json_of(line.min_k)},
          {"max_k", json_of(line.max_k)},
          {"angle_deg", json_of(line.angle_deg)},
          {"pixels_per_unit", json_of(line.pixels_per_unit)},
          {"weight", json_of(line.weight)},
          {"used", line.used},
          {"covered", json_of(line.covered)},
          {"doubtful", line.doubtful}};
}

json json_of(const TemperatureReading& reading) {
  json frames = json::array();
  for (const FrameLine& line : reading.frames) frames.push_back(json_of(line));
  return {{"temperature_k", json_of(reading.temperature_k)},
          {"uncertainty_k", json_of(reading.uncertainty_k)},
          {"assumed_k", json_of(reading.assumed_k)},
          {"field_k", json_of(reading.field_k)},
          {"mean_k", json_of(reading.mean_k)},
          {"min_k", json_of(reading.min_k)},
          {"max_k", json_of(reading.max_k)},
          {"standard_deviation_k", json_of(reading.standard_deviation_k)},
          {"spread_k", json_of(reading.spread_k)},
          {"angle_deg", json_of(reading.angle_deg)},
          {"points", reading.points},
          {"seen_points", reading.seen_points},
          {"seen_share", json_of(reading.seen_share)},
          {"doubtful_share", json_of(reading.doubtful_share())},
          {"outliers", reading.outliers},
          {"frame_count", reading.frames.size()},
          {"frames", frames},
          {"hidden", reading.hidden}};
}

json json_of(const PlacedReading& spot) {
  json j = json_of(spot.reading);
  j["point"] = json_of(spot.position);
  j["normal"] = json_of(spot.normal);
  j["notes"] = spot.notes;
  return j;
}

bool has_reading(Kind kind) {
  return kind == Kind::spot || kind == Kind::box || kind == Kind::polygon || kind == Kind::line;
}

}  // namespace

std::string place_words(std::size_t index) { return fmt::format("place {}: ", index + 1); }

double TemperatureReading::doubtful_share() const {
  double share = 0;
  for (const FrameLine& line : frames) share += line.doubtful ? line.weight : 0;
  return share;
}

const FrameLine* TemperatureReading::best() const {
  const auto rank = [](const FrameLine& line) {
    const double fineness = std::isfinite(line.pixels_per_unit)
                                ? line.pixels_per_unit
                                : std::cos(line.angle_deg * std::numbers::pi / 180);
    return std::tuple(line.used, !line.doubtful,
                      std::isfinite(fineness) ? fineness * line.covered : 0);
  };
  const auto best =
      std::max_element(frames.begin(), frames.end(),
                       [&](const FrameLine& a, const FrameLine& b) { return rank(a) < rank(b); });
  return best == frames.end() ? nullptr : &*best;
}

std::optional<std::string> parameters_differ(const UsedParameters& a, const UsedParameters& b) {
  const auto known_alike = [](double x, double y) { return std::abs(x - y) < 1e-6; };
  const bool unknown_of_one = a.words.empty() || b.words.empty();  // saved by an earlier version
  const bool alike =
      unknown_of_one || a.words == b.words ||
      (known_alike(a.emissivity, b.emissivity) && known_alike(a.reflected_k, b.reflected_k));
  if (alike) return std::nullopt;
  return "the two stand for different object parameters, which make part of the difference: " +
         a.words + "; against " + b.words;
}

json to_json(const Answer& answer) {
  json j = {{"kind", name(answer.kind)}, {"notes", answer.notes}};
  if (!answer.radiometry.words.empty())
    j["radiometry"] = {{"emissivity", json_of(answer.radiometry.emissivity)},
                       {"reflected_k", json_of(answer.radiometry.reflected_k)},
                       {"words", answer.radiometry.words}};
  if (has_reading(answer.kind)) j["reading"] = json_of(answer.reading);
  if (answer.position) j["point"] = json_of(*answer.position);
  if (answer.normal) j["normal"] = json_of(*answer.normal);
  for (const Eigen::Vector3d& end : answer.ends) j["ends"].push_back(json_of(end));
  if (answer.kind == Kind::hottest || answer.kind == Kind::coldest) {
    j["spots"] = json::array();
    for (const PlacedReading& spot : answer.spots) j["spots"].push_back(json_of(spot));
  }
  if (answer.kind == Kind::line) {
    j["profile"] = json::array();
    for (const ProfilePoint& point : answer.profile) {
      json p = {{"along", json_of(point.along)}};
      if (point.at) {
        p["point"] = json_of(point.at->position);
        p["temperature_k"] = json_of(point.at->reading.temperature_k);
        p["uncertainty_k"] = json_of(point.at->reading.uncertainty_k);
        p["field_k"] = json_of(point.at->reading.field_k);
        p["frame_count"] = point.at->reading.frames.size();
        p["doubtful_share"] = json_of(point.at->reading.doubtful_share());
        p["outliers"] = point.at->reading.outliers;
      }
      j["profile"].push_back(std::move(p));
    }
  }
  if (answer.kind == Kind::difference) {
    j["difference_k"] = json_of(answer.difference_k);
    j["uncertainty_k"] = json_of(answer.difference_uncertainty_k);
    for (const Answer& part : answer.of) j["of"].push_back(to_json(part));
    j["parameters_differ"] =
        answer.of.size() == 2 &&
        parameters_differ(answer.of[0].radiometry, answer.of[1].radiometry).has_value();
  }
  if (answer.kind == Kind::distance) {
    j["distance"] = json_of(answer.distance);
    j["distance_uncertainty"] = json_of(answer.distance_uncertainty);
    j["distance_m"] = answer.distance_m ? json_of(*answer.distance_m) : json();
    j["distance_uncertainty_m"] = json_of(answer.distance_uncertainty_m);
  }
  return j;
}

double distance_uncertainty_m(double distance, double uncertainty, double metres_per_unit,
                              double scale_relative_sigma) {
  const double scale = sigmas_of_90_percent * scale_relative_sigma * distance;
  return metres_per_unit * std::hypot(scale, std::isfinite(uncertainty) ? uncertainty : 0);
}

std::string distance_words(const Answer& answer, const char* plus_minus) {
  const auto with = [&](double uncertainty, int digits) {
    return std::isfinite(uncertainty) ? fmt::format(" {} {:.{}f}", plus_minus, uncertainty, digits)
                                      : std::string();
  };
  if (!answer.distance_m)
    return fmt::format("{:.4f} units of the run", answer.distance) +
           with(answer.distance_uncertainty, 4);
  return fmt::format("{:.3f} m", *answer.distance_m) + with(answer.distance_uncertainty_m, 3);
}

}  // namespace orbitfuse::measurement
