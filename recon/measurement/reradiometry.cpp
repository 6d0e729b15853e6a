// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/reradiometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace orbitfuse::measurement {
namespace {

/// A grey body at one wavelength: S = 1 / (e^(B/T) - 1). B = c2 / 10 um; long-wave cameras have
/// 1380 to 1510 K.
constexpr PlanckConstants ten_micrometres{.r1 = 1, .r2 = 1, .b = 1438.8, .f = 1, .o = 0};

Result<FlirCalibration> recorded_with(const ThermalFrame& frame,
                                      const ObjectParameterOverrides& said) {
  if (frame.radiometry) return *frame.radiometry;
  if (!said.emissivity)
    return fail(ErrorKind::usage, "emissivity, reflected temperature, distance or air",
                frame.view.name + " holds temperatures, and not what they were made with",
                "say what the camera was set to (recorded emissivity, and the reflected "
                "temperature if it was not 20 C); or import the camera's radiometric JPEGs");
  FlirCalibration calibration;
  calibration.planck = ten_micrometres;
  calibration.object = with_overrides({}, said);
  return calibration;
}

}  // namespace

Result<Reradiometry> Reradiometry::make(const std::vector<ThermalFrame>& frames,
                                        const ObjectParameterOverrides& object,
                                        const ObjectParameterOverrides& recorded) {
  Reradiometry result;
  if (!object.any()) return result;
  bool assumed = false;
  for (const ThermalFrame& frame : frames) {
    ORBITFUSE_ASSIGN(const FlirCalibration from, recorded_with(frame, recorded));
    assumed = assumed || !frame.radiometry;
    FlirCalibration to = from;
    to.object = with_overrides(from.object, object);
    for (const FlirCalibration& side : {from, to})
      ORBITFUSE_TRY(side.validate("measure").map_error([](Error error) {
        error.kind = ErrorKind::usage;
        error.remedy = "choose a value that a camera would take";
        return error;
      }));
    result.frames_.push_back({from, FlirThermometer(from), FlirThermometer(to)});
  }
  result.alike_ = std::all_of(result.frames_.begin(), result.frames_.end(), [&](const Change& c) {
    return c.recorded == result.frames_.front().recorded;
  });
  if (assumed)
    result.assumption_ = fmt::format(
        "the session has no radiometry: taken as a grey body at 10 um, recorded with emissivity "
        "{:g}, reflected temperature {:.1f} C",
        *recorded.emissivity, recorded.reflected_temperature_k.value_or(293.15) - 273.15);
  return result;
}

double Reradiometry::changed(const Change& change, double kelvin) {
  return change.to.kelvin(change.from.signal(kelvin));
}

double Reradiometry::frame_k(std::size_t frame, double kelvin) const {
  return changes() ? changed(frames_.at(frame), kelvin) : kelvin;
}

double Reradiometry::gain(std::size_t frame, double kelvin) const {
  if (!changes()) return 1;
  constexpr double step = 0.05;
  return (frame_k(frame, kelvin + step) - frame_k(frame, kelvin - step)) / (2 * step);
}

double Reradiometry::field_k(double kelvin) const {
  if (!changes()) return kelvin;
  return alike_ ? changed(frames_.front(), kelvin) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace orbitfuse::measurement
