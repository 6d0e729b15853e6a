// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/radiometry/flir_temperature.hpp"
#include "core/result.hpp"

namespace orbitfuse::measurement {

enum class Kind { spot, box, line, polygon, hottest, coldest, difference, distance };
std::string_view name(Kind kind);

/// Where a measurement is anchored: what a pixel of a view shows, or a point of the scene's world.
struct PixelPlace {
  std::string view;
  Eigen::Vector2d pixel;  ///< as in Camera: the centre of the top-left pixel is (0.5, 0.5)
};
using Place = std::variant<PixelPlace, Eigen::Vector3d>;

/// x_in_world = rotation * x_in_box + center, |x_in_box| <= size / 2. World units.
struct OrientedBox {
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), size = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
};

/// Of hottest and coldest.
inline constexpr int most_places = 100;

/// What is asked; the same from the command line and from JSON (docs/formats.md).
struct Request {
  Kind kind = Kind::spot;
  std::string name;  ///< of the measurement; empty: none
  std::vector<Place>
      places;        ///< spot 1; line, distance 2; polygon 3 or more, pixels of one view or points
  OrientedBox box;   ///< of a box
  int count = 5;     ///< hottest, coldest
  double apart = 0;  ///< least distance between those, world units; 0: a tenth of the object
  int profile = 50;  ///< points along a line
  std::vector<Request> of;            ///< difference: the first less the second
  ObjectParameterOverrides object;    ///< told after capture; absent: as recorded
  ObjectParameterOverrides recorded;  ///< what frames without radiometry were made with

  /// Usage error that names the field: numbers that are not finite or out of range, too few places.
  Status validate() const;
};

nlohmann::json to_json(const Request& request);
/// Usage error that names the field that is missing, of another type or unknown.
Result<Request> request_of_json(const nlohmann::json& json);

}  // namespace orbitfuse::measurement
