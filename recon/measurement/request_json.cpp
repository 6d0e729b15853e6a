// SPDX-License-Identifier: BSD-3-Clause
#include <array>

#include "core/json_fields.hpp"
#include "recon/measurement/request.hpp"

namespace orbitfuse::measurement {
namespace {
using nlohmann::json;

constexpr Kind all_kinds[] = {Kind::spot,    Kind::box,     Kind::line,       Kind::polygon,
                              Kind::hottest, Kind::coldest, Kind::difference, Kind::distance};

/// Of counts; what each takes is its request's to check.
constexpr OptionRange whole_numbers = from_to(-1e6, 1e6);

json as_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

json as_json(const Place& place) {
  if (const auto* pixel = std::get_if<PixelPlace>(&place))
    return {{"view", pixel->view}, {"u", pixel->pixel.x()}, {"v", pixel->pixel.y()}};
  return {{"point", as_json(std::get<Eigen::Vector3d>(place))}};
}

json as_json(const ObjectParameterOverrides& o) {
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

Result<Place> place_of(const JsonFields& table) {
  ORBITFUSE_TRY(table.check_keys({"view", "u", "v", "point"}));
  if (table.has("point")) {
    for (const char* key : {"view", "u", "v"})
      if (table.has(key))
        return fail(ErrorKind::usage, table.at(key), "beside a point",
                    "give either a point, or a view with u and v");
    Eigen::Vector3d point;
    ORBITFUSE_TRY(table.get("point", point));
    return point;
  }
  PixelPlace place;
  ORBITFUSE_TRY(table.get_present("view", place.view));
  ORBITFUSE_TRY(table.get_all("u", place.pixel.x(), "v", place.pixel.y()));
  return place;
}

Result<OrientedBox> box_of(const JsonFields& table) {
  ORBITFUSE_TRY(table.check_keys({"center", "size", "rotation_wxyz"}));
  OrientedBox box;
  ORBITFUSE_TRY(table.get_all("center", box.center, "size", box.size));
  std::array<double, 4> q = {1, 0, 0, 0};
  ORBITFUSE_TRY(table.get_present("rotation_wxyz", q));
  box.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  return box;
}

Result<ObjectParameterOverrides> overrides_of(const JsonFields& table) {
  ORBITFUSE_TRY(table.check_keys(
      {"emissivity", "distance_m", "reflected_k", "atmospheric_k", "relative_humidity"}));
  ObjectParameterOverrides o;
  ORBITFUSE_TRY(table.get_present("emissivity", o.emissivity, "distance_m", o.distance_m,
                                  "reflected_k", o.reflected_temperature_k, "atmospheric_k",
                                  o.atmospheric_temperature_k, "relative_humidity",
                                  o.relative_humidity));
  return o;
}

Result<Kind> kind_of(const JsonFields& table) {
  const std::string word = table.remark("kind");
  std::string known;
  for (const Kind kind : all_kinds) {
    if (name(kind) == word) return kind;
    known += (known.empty() ? "" : ", ") + std::string(name(kind));
  }
  return table.wrong("kind", "one of " + known);
}

Result<Request> parse(const JsonFields& table, int depth) {
  ORBITFUSE_TRY(table.check_keys(
      {"kind", "name", "places", "box", "count", "apart", "profile", "of", "object", "recorded"}));
  Request request;
  ORBITFUSE_ASSIGN(request.kind, kind_of(table));
  ORBITFUSE_TRY(table.get_present("name", request.name, "apart", request.apart));
  if (table.has("places")) {
    ORBITFUSE_ASSIGN(const auto places, table.children("places"));
    for (const JsonFields& place : places) {
      ORBITFUSE_ASSIGN(Place parsed, place_of(place));
      request.places.push_back(std::move(parsed));
    }
  }
  if (table.has("box")) {
    ORBITFUSE_ASSIGN(const JsonFields box, table.child("box"));
    ORBITFUSE_ASSIGN(request.box, box_of(box));
  }
  if (table.has("count")) ORBITFUSE_TRY(table.get("count", request.count, whole_numbers));
  if (table.has("profile")) ORBITFUSE_TRY(table.get("profile", request.profile, whole_numbers));
  for (const auto& [key, overrides] :
       {std::pair{"object", &request.object}, {"recorded", &request.recorded}}) {
    if (!table.has(key)) continue;
    ORBITFUSE_ASSIGN(const JsonFields given, table.child(key));
    ORBITFUSE_ASSIGN(*overrides, overrides_of(given));
  }
  if (table.has("of")) {
    if (depth > 0) return table.wrong("of", "left out: a difference has no differences");
    ORBITFUSE_ASSIGN(const auto parts, table.children("of"));
    for (const JsonFields& part : parts) {
      ORBITFUSE_ASSIGN(Request parsed, parse(part, depth + 1));
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
  for (const Place& place : request.places) j["places"].push_back(as_json(place));
  if (request.kind == Kind::box) {
    const Eigen::Quaterniond& q = request.box.rotation;
    j["box"] = {{"center", as_json(request.box.center)},
                {"size", as_json(request.box.size)},
                {"rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
  }
  if (request.kind == Kind::hottest || request.kind == Kind::coldest) {
    j["count"] = request.count;
    if (request.apart > 0) j["apart"] = request.apart;
  }
  if (request.kind == Kind::line) j["profile"] = request.profile;
  for (const Request& part : request.of) j["of"].push_back(to_json(part));
  if (request.object.any()) j["object"] = as_json(request.object);
  if (request.recorded.any()) j["recorded"] = as_json(request.recorded);
  return j;
}

Result<Request> request_of_json(const json& j) {
  return parse({j, "measurement.", {.kind = ErrorKind::usage, .remedy = {}}}, 0);
}

}  // namespace orbitfuse::measurement
