// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "recon/measurement/answer.hpp"
#include "recon/measurement/thermal_scene.hpp"

namespace orbitfuse::measurement {

/// Error::where of a usage error: what the frames were recorded with has to be said.
inline constexpr const char* recorded_unknown =
    "emissivity, reflected temperature, distance or air";

/// Temperatures as they would be had the camera been told other object parameters: back to the
/// sensor's signal by what the frame was converted with, and from it again with what is said now.
/// The stored frames stay as they are. Within 0.02 K of a conversion of the raw counts (frames hold
/// steps of 0.01 K), times the ratio of the emissivities.
class Reradiometry {
 public:
  /// Leaves all temperatures as they are.
  Reradiometry() = default;

  /// `object`: what holds now, absent fields as recorded. `recorded`: what the temperatures of
  /// frames without radiometry were made with, on the user's word; its emissivity is needed then,
  /// reflected temperature and air are 20 C and the distance 0 unless given, and the band is taken
  /// as a grey body's at 10 um (`assumption` says so).
  /// Errors: usage (a value out of range; frames without radiometry and nothing said of them).
  static Result<Reradiometry> make(const std::vector<ThermalFrame>& frames,
                                   const ObjectParameterOverrides& object,
                                   const ObjectParameterOverrides& recorded);

  bool changes() const { return !frames_.empty(); }
  /// NaN where the signal has no temperature under the parameters.
  double frame_k(std::size_t frame, double kelvin) const;
  /// Of the field, which has learnt from all frames: known where all were converted alike, else
  /// NaN.
  double field_k(double kelvin) const;
  /// By how much a small change of the recorded temperature grows; 1 where nothing changes.
  double gain(std::size_t frame, double kelvin) const;
  /// What was taken for granted; empty: nothing.
  const std::string& assumption() const { return assumption_; }

 private:
  struct Change {
    FlirCalibration recorded;
    FlirThermometer from, to;
  };
  static double changed(const Change& change, double kelvin);
  std::vector<Change> frames_;
  bool alike_ = true;
  std::string assumption_;
};

/// The object parameters that temperatures stand for, with `object` and `recorded` as above.
UsedParameters used_parameters(const std::vector<ThermalFrame>& frames,
                               const ObjectParameterOverrides& object,
                               const ObjectParameterOverrides& recorded);

}  // namespace orbitfuse::measurement
