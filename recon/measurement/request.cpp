// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/request.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/option_range.hpp"

namespace orbitfuse::measurement {
namespace {

constexpr std::array<std::string_view, 8> kind_names{
    "spot", "box", "line", "polygon", "hottest", "coldest", "difference", "distance"};

/// Beyond it coordinates are no scene's, and their squares leave the range of a double's precision.
constexpr double max_coordinate = 1e9;

Status check_place(const Place& place) {
  const OptionCheck check("measure");
  if (const auto* pixel = std::get_if<PixelPlace>(&place)) {
    if (pixel->view.empty())
      return fail(ErrorKind::usage, "measure.view", "empty", "name a view of the run");
    constexpr double widest = 1e6;  // of no camera; what is within is looked up in the view
    for (int i = 0; i < 2; ++i)
      if (const double at = pixel->pixel[i]; !(at >= 0 && at <= widest))
        return fail(ErrorKind::usage, i == 0 ? "measure.u" : "measure.v",
                    fmt::format("{:g}, outside of the picture of {}", at, pixel->view),
                    "count pixels from the top left corner, which is 0,0");
    return {};
  }
  for (const double value : std::get<Eigen::Vector3d>(place))
    ORBITFUSE_TRY(check("point", value, from_to(-max_coordinate, max_coordinate)));
  return {};
}

Status check_box(const OrientedBox& box) {
  const OptionCheck check("measure.box");
  for (int i = 0; i < 3; ++i) {
    ORBITFUSE_TRY(check("center", box.center[i], from_to(-max_coordinate, max_coordinate)));
    ORBITFUSE_TRY(check("size", box.size[i], above_up_to(0, max_coordinate)));
  }
  if (!(std::abs(box.rotation.norm() - 1) < 1e-3))
    return fail(ErrorKind::usage, "measure.box.rotation_wxyz",
                fmt::format("length {:g}", box.rotation.norm()), "give a unit quaternion");
  return {};
}

Status check_places(const Request& request, std::size_t least, std::size_t most) {
  if (request.places.size() < least || request.places.size() > most)
    return fail(
        ErrorKind::usage, fmt::format("measure.{}", name(request.kind)),
        fmt::format("{} places", request.places.size()),
        least == most ? fmt::format("give {}", least) : fmt::format("give {} to {}", least, most));
  for (const Place& place : request.places) ORBITFUSE_TRY(check_place(place));
  return {};
}

Status check_overrides(const ObjectParameterOverrides& o, const char* table) {
  const OptionCheck check(table);
  if (o.emissivity) ORBITFUSE_TRY(check("emissivity", *o.emissivity, from_to(0.01, 1)));
  if (o.distance_m) ORBITFUSE_TRY(check("distance_m", *o.distance_m, from_to(0, 1e5)));
  if (o.reflected_temperature_k)
    ORBITFUSE_TRY(check("reflected_k", *o.reflected_temperature_k, from_to(1, 5000)));
  if (o.atmospheric_temperature_k)
    ORBITFUSE_TRY(check("atmospheric_k", *o.atmospheric_temperature_k, from_to(150, 400)));
  if (o.relative_humidity)
    ORBITFUSE_TRY(check("relative_humidity", *o.relative_humidity, from_to(0, 1)));
  return {};
}

Status check_polygon(const Request& request) {
  ORBITFUSE_TRY(check_places(request, 3, 1000));
  const auto* first = std::get_if<PixelPlace>(&request.places[0]);
  for (const Place& place : request.places) {
    const auto* pixel = std::get_if<PixelPlace>(&place);
    if ((pixel == nullptr) != (first == nullptr) || (pixel && pixel->view != first->view))
      return fail(ErrorKind::usage, "measure.polygon",
                  "corners that are neither pixels of one view nor all points",
                  "give all corners in the same view, or each as a point");
  }
  return {};
}

}  // namespace

std::string_view name(Kind kind) { return kind_names.at(static_cast<std::size_t>(kind)); }

Status Request::validate() const {
  const OptionCheck check("measure");
  ORBITFUSE_TRY(check_overrides(object, "measure.object"));
  ORBITFUSE_TRY(check_overrides(recorded, "measure.recorded"));
  switch (kind) {
    case Kind::spot:
      return check_places(*this, 1, 1);
    case Kind::box:
      return check_box(box);
    case Kind::line:
      ORBITFUSE_TRY(check("profile", profile, from_to(2, 1000)));
      return check_places(*this, 2, 2);
    case Kind::distance:
      return check_places(*this, 2, 2);
    case Kind::polygon:
      return check_polygon(*this);
    case Kind::hottest:
    case Kind::coldest:
      ORBITFUSE_TRY(check("count", count, from_to(1, most_places)));
      return check("apart", apart, from_to(0, max_coordinate));
    case Kind::difference:
      if (of.size() != 2)
        return fail(ErrorKind::usage, "measure.difference",
                    fmt::format("{} measurements", of.size()), "give two");
      if (object.any() || recorded.any())
        return fail(ErrorKind::usage, object.any() ? "measure.object" : "measure.recorded",
                    "given for the difference itself", "give it in each of its two measurements");
      for (const Request& part : of) {
        if (part.kind == Kind::difference || part.kind == Kind::distance)
          return fail(ErrorKind::usage, "measure.difference",
                      fmt::format("a {} as its part", measurement::name(part.kind)),
                      "give measurements that have a temperature");
        ORBITFUSE_TRY(part.validate());
      }
      return {};
  }
  return {};
}

}  // namespace orbitfuse::measurement
