// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "recon/measurement/answer.hpp"

namespace orbitfuse::measurement {
namespace {
using nlohmann::json;

/// Reads the keys of one object and remembers the first that is of another type.
class Reader {
 public:
  Reader(const json& j, std::string where) : json_(j), where_(std::move(where)) {
    if (!j.is_object()) complain("", "an object");
  }

  void number(const char* key, double& value) {
    if (const json* found = find(key)) {
      if (!found->is_number()) return complain(key, "a number");
      value = found->get<double>();
    }
  }
  void integer(const char* key, int& value) {
    if (const json* found = find(key)) {
      if (!found->is_number_integer()) return complain(key, "a whole number");
      value = found->get<int>();
    }
  }
  void boolean(const char* key, bool& value) {
    if (const json* found = find(key)) {
      if (!found->is_boolean()) return complain(key, "true or false");
      value = found->get<bool>();
    }
  }
  void text(const char* key, std::string& value) {
    if (const json* found = find(key)) {
      if (!found->is_string()) return complain(key, "a text");
      value = found->get<std::string>();
    }
  }
  std::optional<Eigen::Vector3d> vector(const char* key) {
    const json* found = find(key);
    if (found == nullptr) return std::nullopt;
    auto value = vector_of(*found);
    if (!value) complain(key, "three numbers");
    return value;
  }
  /// Calls `use` with every entry of a list and its name.
  template <class Use>
  void each(const char* key, const Use& use) {
    const json* found = find(key);
    if (found == nullptr) return;
    if (!found->is_array()) return complain(key, "a list");
    for (std::size_t i = 0; i < found->size() && !error_; ++i)
      use((*found)[i], where_ + "." + key + "[" + std::to_string(i) + "]");
  }
  const json* find(const char* key) const {
    if (!json_.is_object()) return nullptr;
    const auto at = json_.find(key);
    return at == json_.end() || at->is_null() ? nullptr : &*at;
  }
  static std::optional<Eigen::Vector3d> vector_of(const json& j) {
    if (!j.is_array() || j.size() != 3) return std::nullopt;
    Eigen::Vector3d v;
    for (std::size_t i = 0; i < 3; ++i) {
      if (!j[i].is_number()) return std::nullopt;
      v[static_cast<Eigen::Index>(i)] = j[i].get<double>();
    }
    return v;
  }
  void complain(const std::string& key, const char* wanted) {
    if (error_) return;
    error_ = Error{ErrorKind::input, where_ + (key.empty() ? "" : "." + key),
                   "not " + std::string(wanted), "mend it, or measure again"};
  }
  void take(const Status& status) {
    if (!status && !error_) error_ = status.error();
  }
  Status status() const {
    if (error_) return tl::unexpected(*error_);
    return {};
  }

 private:
  const json& json_;
  std::string where_;
  std::optional<Error> error_;
};

Status read(const json& j, const std::string& where, FrameLine& line) {
  Reader in(j, where);
  in.text("frame", line.frame);
  line.pixel.setConstant(unknown);
  in.number("u", line.pixel.x());
  in.number("v", line.pixel.y());
  in.number("mean_k", line.mean_k);
  in.number("min_k", line.min_k);
  in.number("max_k", line.max_k);
  in.number("angle_deg", line.angle_deg);
  in.number("pixels_per_unit", line.pixels_per_unit);
  in.number("weight", line.weight);
  in.boolean("used", line.used);
  in.number("covered", line.covered);
  in.boolean("doubtful", line.doubtful);
  return in.status();
}

Status read(const json& j, const std::string& where, TemperatureReading& reading) {
  Reader in(j, where);
  in.number("temperature_k", reading.temperature_k);
  in.number("uncertainty_k", reading.uncertainty_k);
  in.number("assumed_k", reading.assumed_k);
  in.number("field_k", reading.field_k);
  in.number("mean_k", reading.mean_k);
  in.number("min_k", reading.min_k);
  in.number("max_k", reading.max_k);
  in.number("standard_deviation_k", reading.standard_deviation_k);
  in.number("spread_k", reading.spread_k);
  in.number("angle_deg", reading.angle_deg);
  in.integer("points", reading.points);
  in.integer("seen_points", reading.seen_points);
  in.number("seen_share", reading.seen_share);
  in.text("outliers", reading.outliers);
  in.text("hidden", reading.hidden);
  in.each("frames", [&](const json& entry, const std::string& at) {
    FrameLine line;
    in.take(read(entry, at, line));
    reading.frames.push_back(std::move(line));
  });
  return in.status();
}

Status read(const json& j, const std::string& where, PlacedReading& spot) {
  Reader in(j, where);
  spot.position = in.vector("point").value_or(Eigen::Vector3d::Constant(unknown));
  spot.normal = in.vector("normal").value_or(Eigen::Vector3d::Zero());
  in.take(read(j, where, spot.reading));
  return in.status();
}

Status read_profile(const json& j, const std::string& where, ProfilePoint& point) {
  Reader in(j, where);
  in.number("along", point.along);
  if (in.find("point") == nullptr) return in.status();
  point.at.emplace();
  point.at->position = in.vector("point").value_or(Eigen::Vector3d::Constant(unknown));
  point.at->normal.setZero();
  in.number("temperature_k", point.at->reading.temperature_k);
  in.number("uncertainty_k", point.at->reading.uncertainty_k);
  in.number("field_k", point.at->reading.field_k);
  in.text("outliers", point.at->reading.outliers);
  return in.status();
}

Status read_radiometry(const json& j, const std::string& where, UsedParameters& used) {
  Reader in(j, where);
  in.number("emissivity", used.emissivity);
  in.number("reflected_k", used.reflected_k);
  in.text("words", used.words);
  return in.status();
}

Status read_kind(Reader& in, Kind& kind) {
  std::string word;
  in.text("kind", word);
  for (const Kind known : {Kind::spot, Kind::box, Kind::line, Kind::polygon, Kind::hottest,
                           Kind::coldest, Kind::difference, Kind::distance})
    if (word == name(known)) {
      kind = known;
      return {};
    }
  in.complain("kind", "a kind of measurement");
  return in.status();
}

Status read(const json& j, const std::string& where, Answer& answer, int depth) {
  Reader in(j, where);
  ORBITFUSE_TRY(in.status());
  ORBITFUSE_TRY(read_kind(in, answer.kind));
  in.each("notes", [&](const json& note, const std::string&) {
    if (note.is_string())
      answer.notes.push_back(note.get<std::string>());
    else
      in.complain("notes", "a list of texts");
  });
  if (const json* found = in.find("reading"))
    in.take(read(*found, where + ".reading", answer.reading));
  if (const json* found = in.find("radiometry"))
    in.take(read_radiometry(*found, where + ".radiometry", answer.radiometry));
  answer.position = in.vector("point");
  answer.normal = in.vector("normal");
  in.each("spots", [&](const json& entry, const std::string& at) {
    answer.spots.emplace_back();
    in.take(read(entry, at, answer.spots.back()));
  });
  in.each("profile", [&](const json& entry, const std::string& at) {
    answer.profile.emplace_back();
    in.take(read_profile(entry, at, answer.profile.back()));
  });
  in.each("ends", [&](const json& entry, const std::string&) {
    const auto end = Reader::vector_of(entry);
    if (end)
      answer.ends.push_back(*end);
    else
      in.complain("ends", "a list of points");
  });
  in.number("difference_k", answer.difference_k);
  in.number("uncertainty_k", answer.difference_uncertainty_k);
  in.number("distance", answer.distance);
  double metres = unknown;
  in.number("distance_m", metres);
  if (std::isfinite(metres)) answer.distance_m = metres;
  in.number("distance_uncertainty_m", answer.distance_uncertainty_m);
  in.each("of", [&](const json& entry, const std::string& at) {
    // A difference has no differences as its parts.
    if (depth > 0) return in.complain("of", "absent");
    answer.of.emplace_back();
    in.take(read(entry, at, answer.of.back(), depth + 1));
  });
  return in.status();
}

}  // namespace

Result<Answer> answer_of_json(const json& j) {
  Answer answer;
  ORBITFUSE_TRY(read(j, "answer", answer, 0));
  return answer;
}

}  // namespace orbitfuse::measurement
