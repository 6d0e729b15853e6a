// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <initializer_list>

#include "core/temperature.hpp"
#include "recon/measurement/request.hpp"

namespace orbitfuse::measurement {
namespace {
using nlohmann::json;

constexpr Kind all_kinds[] = {Kind::spot,    Kind::box,     Kind::line,       Kind::polygon,
                              Kind::hottest, Kind::coldest, Kind::difference, Kind::distance};

json json_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

json json_of(const Place& place) {
  if (const auto* pixel = std::get_if<PixelPlace>(&place))
    return {{"view", pixel->view}, {"u", pixel->pixel.x()}, {"v", pixel->pixel.y()}};
  return {{"point", json_of(std::get<Eigen::Vector3d>(place))}};
}

json json_of(const ObjectParameterOverrides& o) {
  json j = json::object();
  const auto put = [&](const char* key, const std::optional<double>& value) {
    if (value) j[key] = *value;
  };
  put("emissivity", o.emissivity);
  put("distance_m", o.distance_m);
  put("reflected_k", o.reflected_temperature_k);
  put("atmospheric_k", o.atmospheric_temperature_k);
  put("relative_humidity", o.relative_humidity);
  return j;
}

tl::unexpected<Error> wrong(const std::string& where, const json& found,
                            const std::string& wanted) {
  return fail(ErrorKind::usage, where, "found " + found.dump().substr(0, 60), "give " + wanted);
}

/// Typed access to one table; every error names the field.
class Table {
 public:
  Table(const json& table, std::string where) : json_(table), where_(std::move(where)) {}

  Status check_keys(std::initializer_list<const char*> known) const {
    if (!json_.is_object()) return wrong(where_, json_, "a table");
    for (const auto& [key, value] : json_.items()) {
      bool found = false;
      for (const char* name : known) found = found || key == name;
      if (!found) return fail(ErrorKind::usage, where_ + "." + key, "unknown", "leave it out");
    }
    return {};
  }
  bool has(const char* key) const { return json_.contains(key) && !json_.at(key).is_null(); }
  std::string at(const char* key) const { return where_ + "." + key; }
  const json& get(const char* key) const { return json_.at(key); }

  Status number(const char* key, double& out) const {
    if (!has(key)) return fail(ErrorKind::usage, at(key), "missing", "give a number");
    if (!get(key).is_number()) return wrong(at(key), get(key), "a number");
    out = get(key).get<double>();
    return {};
  }
  Status optional(const char* key, std::optional<double>& out) const {
    if (!has(key)) return {};
    double value = 0;
    ORBITFUSE_TRY(number(key, value));
    out = value;
    return {};
  }
  Status integer(const char* key, int& out) const {
    if (!has(key)) return {};
    const json& value = get(key);
    if (!value.is_number_integer() || value > 1'000'000 || value < -1'000'000)
      return wrong(at(key), value, "a whole number");
    out = value.get<int>();
    return {};
  }
  Status text(const char* key, std::string& out) const {
    if (!has(key)) return {};
    if (!get(key).is_string()) return wrong(at(key), get(key), "a text");
    out = get(key).get<std::string>();
    return {};
  }
  Status vector(const char* key, Eigen::Vector3d& out) const {
    if (!has(key)) return fail(ErrorKind::usage, at(key), "missing", "give three numbers");
    const json& value = get(key);
    if (!value.is_array() || value.size() != 3) return wrong(at(key), value, "three numbers");
    for (std::size_t i = 0; i < 3; ++i) {
      if (!value[i].is_number()) return wrong(at(key), value, "three numbers");
      out[static_cast<Eigen::Index>(i)] = value[i].get<double>();
    }
    return {};
  }

 private:
  const json& json_;
  std::string where_;
};

Result<Place> place_of(const json& j, const std::string& where) {
  const Table table(j, where);
  ORBITFUSE_TRY(table.check_keys({"view", "u", "v", "point"}));
  if (table.has("point")) {
    for (const char* key : {"view", "u", "v"})
      if (table.has(key))
        return fail(ErrorKind::usage, table.at(key), "beside a point",
                    "give either a point, or a view with u and v");
    Eigen::Vector3d point;
    ORBITFUSE_TRY(table.vector("point", point));
    return point;
  }
  PixelPlace place;
  ORBITFUSE_TRY(table.text("view", place.view));
  ORBITFUSE_TRY(table.number("u", place.pixel.x()));
  ORBITFUSE_TRY(table.number("v", place.pixel.y()));
  return place;
}

Result<OrientedBox> box_of(const json& j, const std::string& where) {
  const Table table(j, where);
  ORBITFUSE_TRY(table.check_keys({"center", "size", "rotation_wxyz"}));
  OrientedBox box;
  ORBITFUSE_TRY(table.vector("center", box.center));
  ORBITFUSE_TRY(table.vector("size", box.size));
  if (!table.has("rotation_wxyz")) return box;
  const json& q = table.get("rotation_wxyz");
  if (!q.is_array() || q.size() != 4) return wrong(table.at("rotation_wxyz"), q, "four numbers");
  for (const json& value : q)
    if (!value.is_number()) return wrong(table.at("rotation_wxyz"), q, "four numbers");
  box.rotation = Eigen::Quaterniond(q[0].get<double>(), q[1].get<double>(), q[2].get<double>(),
                                    q[3].get<double>());
  return box;
}

Result<ObjectParameterOverrides> overrides_of(const json& j, const std::string& where) {
  const Table table(j, where);
  ORBITFUSE_TRY(table.check_keys(
      {"emissivity", "distance_m", "reflected_k", "atmospheric_k", "relative_humidity"}));
  ObjectParameterOverrides o;
  ORBITFUSE_TRY(table.optional("emissivity", o.emissivity));
  ORBITFUSE_TRY(table.optional("distance_m", o.distance_m));
  ORBITFUSE_TRY(table.optional("reflected_k", o.reflected_temperature_k));
  ORBITFUSE_TRY(table.optional("atmospheric_k", o.atmospheric_temperature_k));
  ORBITFUSE_TRY(table.optional("relative_humidity", o.relative_humidity));
  return o;
}

Result<Kind> kind_of(const Table& table) {
  std::string word;
  ORBITFUSE_TRY(table.text("kind", word));
  for (const Kind kind : all_kinds)
    if (name(kind) == word) return kind;
  std::string known;
  for (const Kind kind : all_kinds) known += (known.empty() ? "" : ", ") + std::string(name(kind));
  return fail(ErrorKind::usage, table.at("kind"), word.empty() ? "missing" : "'" + word + "'",
              "choose one of " + known);
}

Result<Request> parse(const json& j, const std::string& where, int depth) {
  const Table table(j, where);
  ORBITFUSE_TRY(table.check_keys(
      {"kind", "name", "places", "box", "count", "apart", "profile", "of", "object", "recorded"}));
  Request request;
  ORBITFUSE_ASSIGN(request.kind, kind_of(table));
  ORBITFUSE_TRY(table.text("name", request.name));
  for (const char* list : {"places", "of"})
    if (table.has(list) && !table.get(list).is_array())
      return wrong(table.at(list), table.get(list), "a list");
  if (table.has("places"))
    for (const json& place : table.get("places")) {
      ORBITFUSE_ASSIGN(Place parsed, place_of(place, table.at("places")));
      request.places.push_back(std::move(parsed));
    }
  if (table.has("box")) {
    ORBITFUSE_ASSIGN(request.box, box_of(table.get("box"), table.at("box")));
  }
  ORBITFUSE_TRY(table.integer("count", request.count));
  ORBITFUSE_TRY(table.integer("profile", request.profile));
  if (table.has("apart")) ORBITFUSE_TRY(table.number("apart", request.apart));
  if (table.has("object")) {
    ORBITFUSE_ASSIGN(request.object, overrides_of(table.get("object"), table.at("object")));
  }
  if (table.has("recorded")) {
    ORBITFUSE_ASSIGN(request.recorded, overrides_of(table.get("recorded"), table.at("recorded")));
  }
  if (table.has("of")) {
    if (depth > 0) return wrong(table.at("of"), table.get("of"), "no difference of differences");
    for (const json& part : table.get("of")) {
      ORBITFUSE_ASSIGN(Request parsed, parse(part, table.at("of"), depth + 1));
      request.of.push_back(std::move(parsed));
    }
  }
  ORBITFUSE_TRY(request.validate());
  return request;
}

}  // namespace

json to_json(const Request& request) {
  json j = {{"kind", name(request.kind)}};
  if (!request.name.empty()) j["name"] = request.name;
  for (const Place& place : request.places) j["places"].push_back(json_of(place));
  if (request.kind == Kind::box) {
    const Eigen::Quaterniond& q = request.box.rotation;
    j["box"] = {{"center", json_of(request.box.center)},
                {"size", json_of(request.box.size)},
                {"rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
  }
  if (request.kind == Kind::hottest || request.kind == Kind::coldest) {
    j["count"] = request.count;
    if (request.apart > 0) j["apart"] = request.apart;
  }
  if (request.kind == Kind::line) j["profile"] = request.profile;
  for (const Request& part : request.of) j["of"].push_back(to_json(part));
  if (request.object.any()) j["object"] = json_of(request.object);
  if (request.recorded.any()) j["recorded"] = json_of(request.recorded);
  return j;
}

Result<Request> request_of_json(const json& j) { return parse(j, "measurement", 0); }

}  // namespace orbitfuse::measurement
