// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <vector>

#include "recon/measurement/reradiometry.hpp"
#include "recon/measurement/thermal_scene.hpp"

// What the original thermal frames say of a point of the surface.
namespace orbitfuse::measurement {

/// One frame that sees the point.
struct FrameReading {
  std::size_t frame = 0;  ///< index into ThermalScene::frames()
  Eigen::Vector2d pixel;  ///< in the frame, as in Camera
  double temperature_k = 0;
  double angle_deg = 0;          ///< of the line of sight to the surface's normal
  double pixels_per_unit = 0;    ///< FrameLine::pixels_per_unit
  double gradient_k_per_px = 0;  ///< steepest within a pose error's reach
  double gain = 1;               ///< of changed object parameters (Reradiometry)
  double weight = 0;             ///< against the other frames; all of a point's sum to 1
  bool used = true;              ///< in the point's estimate
};

/// Why a frame doesn't see a point.
enum class Hidden {
  behind_camera,
  outside_picture,
  grazing,
  occluded,
  no_surface,
  no_temperature,
  /// Nothing as warm as the sensor saw it can be of these object parameters.
  impossible_parameters
};
inline constexpr std::size_t hidden_kinds = 7;

struct PointReadings {
  std::vector<FrameReading> frames;
  std::array<int, hidden_kinds> hidden{};  ///< frames by Hidden
  bool seen() const { return !frames.empty(); }
  /// "13 outside of the picture, 5 occluded"
  std::string why_hidden() const;
};

/// Each frame's temperature at the point, where its depth map has a surface at that distance, with
/// weights: a pixel seen at a slant covers more, a gradient turns an error of the pose into one of
/// temperature, and a doubtful pose counts for less.
/// `surface.normal` may be zero: angles are then not tested, and told as 0.
/// Errors: those of ThermalScene::image and seen.
Result<PointReadings> read_frames(const ThermalScene& scene, const SurfacePoint& surface,
                                  const Reradiometry& radiometry, const Progress& progress);

}  // namespace orbitfuse::measurement
