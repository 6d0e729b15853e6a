// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "recon/measurement/request.hpp"

namespace orbitfuse::measurement {

inline constexpr double sigmas_of_90_percent = 1.645;
inline constexpr const char* no_scale_note = "no scale: the run doesn't know its unit in metres";

inline constexpr const char* ends_unknown_note =
    "+- is of the scale alone: an earlier version saved it; measure it again for that of its ends";

inline constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// What one original frame says of a spot or region. Kelvin; of a spot mean = min = max.
struct FrameLine {
  std::string frame;      ///< file in the session
  Eigen::Vector2d pixel;  ///< of the spot, or of the region's middle
  double mean_k = unknown, min_k = unknown, max_k = unknown;
  double angle_deg = unknown;  ///< of the line of sight to the surface's normal; region: mean
  /// How finely it sees the place: pixels of the frame along a world unit of the surface, shortened
  /// by the angle. NaN: not known (saved by an earlier version).
  double pixels_per_unit = unknown;
  double weight = 0;      ///< of all frames: 1; 0: left out
  bool used = true;       ///< false: it shows something else than most (another surface)
  double covered = 1;     ///< share of the region's points that it sees
  bool doubtful = false;  ///< its pose
};

/// The temperature of a spot or region.
struct TemperatureReading {
  /// The frames' weighted mean at the place (of a region: of its points, by area); NaN: no frame
  /// sees it. The field isn't mixed in.
  double temperature_k = unknown;
  /// The error of temperature_k, apart from the camera's own calibration and the object parameters,
  /// is below this in 90 of 100 cases. From the spread between frames, what an error of the poses
  /// makes of the gradient there, noise, and the difference of field and frames. NaN: unknown.
  double uncertainty_k = unknown;
  /// What it would be by the constant for the camera alone (common_sigma_k): assumed, because no
  /// frame shows what all of them share.
  double assumed_k = unknown;
  double field_k = unknown;  ///< of the trained field; also where no frame sees the place
  /// Over the frames' readings of a spot; over the points of a region.
  double mean_k = unknown, min_k = unknown, max_k = unknown, standard_deviation_k = unknown;
  double spread_k = unknown;   ///< standard deviation between frames; NaN: fewer than two
  double angle_deg = unknown;  ///< weighted mean over frames
  int points = 1;              ///< surface points that were asked for
  int seen_points = 0;         ///< of those, such that a frame sees
  double seen_share = 0;       ///< of the area, that a frame sees
  std::vector<FrameLine> frames;
  std::string outliers;  ///< "4 of 10 frames left out: 36.9 C against 26.9 C"; empty: none
  std::string hidden;  ///< what hides it from the others: "13 outside of their picture, 5 occluded"
  bool seen() const { return !frames.empty(); }
  /// Of the weight: frames whose pose is doubtful.
  double doubtful_share() const;
  /// The frame that sees the place best: finest by distance and angle, most of a region, and of
  /// those whose pose is sure, while there is one. None: no frame sees it.
  const FrameLine* best() const;
};

/// A spot with its place.
struct PlacedReading {
  Eigen::Vector3d position, normal;
  TemperatureReading reading;
  std::vector<std::string> notes = {};  ///< of this place alone; Answer::notes has them too
};

/// Object parameters behind an answer's temperatures.
struct UsedParameters {
  /// Of all frames alike; NaN: not recorded, or not alike.
  double emissivity = unknown, reflected_k = unknown;
  /// "emissivity 0.95, reflected temperature 20.0 C, as recorded"; empty: nothing was asked that
  /// has a temperature of its own.
  std::string words;
};

struct ProfilePoint {
  double along = 0;  ///< world units from the line's start, over the surface's points
  std::optional<PlacedReading> at;  ///< none: no surface there
};

struct Answer {
  Kind kind = Kind::spot;
  TemperatureReading reading;  ///< of spot, box, polygon, line (its points together)
  std::optional<Eigen::Vector3d> position, normal;  ///< of a spot; of a region the middle
  std::vector<PlacedReading> spots;  ///< hottest, coldest; by what is sure (region.hpp)
  std::vector<ProfilePoint> profile;
  std::vector<Eigen::Vector3d> ends;  ///< of a line or distance, where both meet the surface
  /// The camera's part of both uncertainties counts in full: two places lie on different samples
  /// of the sensor, and of what is assumed only drift, a part unknown, is the same for both.
  double difference_k = unknown, difference_uncertainty_k = unknown;
  std::vector<Answer> of;  ///< of a difference
  /// World units. The error is below the uncertainty in 90 of 100 cases: of where the places lie.
  double distance = unknown, distance_uncertainty = unknown;
  std::optional<double> distance_m;         ///< where the run's scale is known
  double distance_uncertainty_m = unknown;  ///< of the places and of the scale together
  UsedParameters radiometry;                ///< of a difference: in its parts
  /// What the reader must know: nothing seen, assumptions. Those of one of several places begin
  /// with place_words().
  std::vector<std::string> notes;
};

/// "place 2: ", of the second of several.
std::string place_words(std::size_t index);

nlohmann::json to_json(const Answer& answer);
/// Of a distance in world units with its uncertainty (NaN: not known, counts as none), by a scale
/// with a relative standard deviation.
double distance_uncertainty_m(double distance, double uncertainty, double metres_per_unit,
                              double scale_relative_sigma);
/// "1.204 m +- 0.012", or "0.8812 units of the run +- 0.0043" where it knows no metres.
std::string distance_words(const Answer& answer, const char* plus_minus = "+-");
/// Temperatures of other object parameters are not to be compared without a word: those words,
/// where emissivity or reflected temperature of the two differ or may. None: they are alike.
std::optional<std::string> parameters_differ(const UsedParameters& a, const UsedParameters& b);
/// What to_json() wrote, but for what stands behind the points of a profile. What is null or absent
/// is not known. Input error naming the key that has another type.
Result<Answer> answer_of_json(const nlohmann::json& json);

}  // namespace orbitfuse::measurement
