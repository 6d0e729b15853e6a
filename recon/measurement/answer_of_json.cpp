// SPDX-License-Identifier: BSD-3-Clause
#include "core/json_fields.hpp"
#include "recon/measurement/answer.hpp"

namespace orbitfuse::measurement {
namespace {
using nlohmann::json;

/// A point that isn't there is not known.
Result<std::optional<Eigen::Vector3d>> point_at(const JsonFields& in, const char* key) {
  std::optional<Eigen::Vector3d> point;
  ORBITFUSE_TRY(in.get_present(key, point));
  return point;
}

Status read(const JsonFields& in, FrameLine& line) {
  line.pixel.setConstant(unknown);
  ORBITFUSE_TRY(in.get_present("frame", line.frame, "u", line.pixel.x(), "v", line.pixel.y()));
  ORBITFUSE_TRY(in.get_present("mean_k", line.mean_k, "min_k", line.min_k, "max_k", line.max_k));
  return in.get_present("angle_deg", line.angle_deg, "pixels_per_unit", line.pixels_per_unit,
                        "weight", line.weight, "used", line.used, "covered", line.covered,
                        "doubtful", line.doubtful);
}

/// Calls `use` with each entry of a list of objects, where there is one.
template <class Use>
Status each(const JsonFields& in, const char* key, const Use& use) {
  if (!in.has(key)) return {};
  ORBITFUSE_ASSIGN(const std::vector<JsonFields> entries, in.children(key));
  for (const JsonFields& entry : entries) ORBITFUSE_TRY(use(entry));
  return {};
}

Status read(const JsonFields& in, TemperatureReading& r) {
  ORBITFUSE_TRY(in.get_present("temperature_k", r.temperature_k, "uncertainty_k", r.uncertainty_k,
                               "assumed_k", r.assumed_k, "field_k", r.field_k));
  ORBITFUSE_TRY(in.get_present("mean_k", r.mean_k, "min_k", r.min_k, "max_k", r.max_k,
                               "standard_deviation_k", r.standard_deviation_k, "spread_k",
                               r.spread_k));
  ORBITFUSE_TRY(in.get_present("angle_deg", r.angle_deg, "points", r.points, "seen_points",
                               r.seen_points, "seen_share", r.seen_share));
  ORBITFUSE_TRY(in.get_present("outliers", r.outliers, "hidden", r.hidden));
  return each(in, "frames",
              [&](const JsonFields& entry) { return read(entry, r.frames.emplace_back()); });
}

Status read(const JsonFields& in, PlacedReading& spot) {
  ORBITFUSE_ASSIGN(const auto position, point_at(in, "point"));
  ORBITFUSE_ASSIGN(const auto normal, point_at(in, "normal"));
  spot.position = position.value_or(Eigen::Vector3d::Constant(unknown));
  spot.normal = normal.value_or(Eigen::Vector3d::Zero());
  ORBITFUSE_TRY(in.get_present("notes", spot.notes));
  return read(in, spot.reading);
}

Status read(const JsonFields& in, ProfilePoint& point) {
  ORBITFUSE_TRY(in.get_present("along", point.along));
  if (!in.has("point")) return {};
  PlacedReading& at = point.at.emplace();
  at.normal.setZero();
  ORBITFUSE_TRY(in.get("point", at.position));
  return in.get_present("temperature_k", at.reading.temperature_k, "uncertainty_k",
                        at.reading.uncertainty_k, "field_k", at.reading.field_k, "outliers",
                        at.reading.outliers);
}

Status read(const JsonFields& in, UsedParameters& used) {
  return in.get_present("emissivity", used.emissivity, "reflected_k", used.reflected_k, "words",
                        used.words);
}

/// Of an object that may be absent.
template <class T>
Status read_child(const JsonFields& in, const char* key, T& part) {
  if (!in.has(key)) return {};
  ORBITFUSE_ASSIGN(const JsonFields child, in.child(key));
  return read(child, part);
}

Status read(const JsonFields& in, Kind& kind) {
  const std::string word = in.remark("kind");
  for (const Kind known : {Kind::spot, Kind::box, Kind::line, Kind::polygon, Kind::hottest,
                           Kind::coldest, Kind::difference, Kind::distance})
    if (word == name(known)) {
      kind = known;
      return {};
    }
  return in.wrong("kind", "a kind of measurement");
}

Status read(const JsonFields& in, Answer& answer, int depth) {
  ORBITFUSE_TRY(in.check_object());
  ORBITFUSE_TRY(read(in, answer.kind));
  ORBITFUSE_TRY(in.get_present("notes", answer.notes));
  ORBITFUSE_TRY(read_child(in, "reading", answer.reading));
  ORBITFUSE_TRY(read_child(in, "radiometry", answer.radiometry));
  ORBITFUSE_TRY(in.get_present("point", answer.position, "normal", answer.normal));
  ORBITFUSE_TRY(each(in, "spots", [&](const JsonFields& entry) {
    return read(entry, answer.spots.emplace_back());
  }));
  ORBITFUSE_TRY(each(in, "profile", [&](const JsonFields& entry) {
    return read(entry, answer.profile.emplace_back());
  }));
  ORBITFUSE_TRY(in.get_present("ends", answer.ends, "difference_k", answer.difference_k,
                               "uncertainty_k", answer.difference_uncertainty_k, "distance",
                               answer.distance, "distance_uncertainty", answer.distance_uncertainty,
                               "distance_m", answer.distance_m, "distance_uncertainty_m",
                               answer.distance_uncertainty_m));
  if (const json* of = in.find("of"); of != nullptr && !of->empty() && depth > 0)
    return in.wrong("of", "absent: a difference has no differences as its parts");
  return each(in, "of", [&](const JsonFields& entry) {
    return read(entry, answer.of.emplace_back(), depth + 1);
  });
}

}  // namespace

Result<Answer> answer_of_json(const json& j) {
  Answer answer;
  ORBITFUSE_TRY(read({j, "answer.", {ErrorKind::input, "mend it, or measure again"}}, answer, 0));
  return answer;
}

}  // namespace orbitfuse::measurement
