// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/reradiometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "core/temperature.hpp"

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

namespace {

/// What frames have of one parameter.
struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  bool all = true;  ///< every frame has it
  void add(double value) { low = std::min(low, value), high = std::max(high, value); }
  double same() const { return all && low == high ? low : unknown; }
};

std::string words_of(const Range& r, const char* what, int digits, const char* unit,
                     const char* source) {
  if (!r.all) return fmt::format("{} not recorded", what);
  return r.low == r.high ? fmt::format("{} {:.{}f}{}{}", what, r.low, digits, unit, source)
                         : fmt::format("{} {:.{}f} to {:.{}f}{}{}", what, r.low, digits, r.high,
                                       digits, unit, source);
}

}  // namespace

UsedParameters used_parameters(const std::vector<ThermalFrame>& frames,
                               const ObjectParameterOverrides& object,
                               const ObjectParameterOverrides& recorded) {
  Range emissivity, reflected_k;
  const auto add = [](Range& range, const std::optional<double>& asked,
                      const std::optional<double>& known) {
    if (asked || known)
      range.add(asked ? *asked : *known);
    else
      range.all = false;
  };
  for (const ThermalFrame& frame : frames) {
    const auto known = [&](double ObjectParameters::*of) {
      return frame.radiometry ? std::optional(frame.radiometry->object.*of) : std::nullopt;
    };
    const auto e = known(&ObjectParameters::emissivity);
    const auto t = known(&ObjectParameters::reflected_k);
    add(emissivity, object.emissivity, e ? e : recorded.emissivity);
    add(reflected_k, object.reflected_temperature_k, t ? t : recorded.reflected_temperature_k);
  }
  UsedParameters used;
  if (frames.empty()) return used;
  used.emissivity = emissivity.same();
  used.reflected_k = reflected_k.same();
  if (!emissivity.all && !reflected_k.all) {
    used.words = "emissivity not recorded: temperatures as the camera gave them";
    return used;
  }
  Range celsius = reflected_k;
  celsius.low = celsius_from_kelvin(celsius.low);
  celsius.high = celsius_from_kelvin(celsius.high);
  used.words =
      words_of(emissivity, "emissivity", 2, "", object.emissivity ? " as asked" : " as recorded") +
      ", " +
      words_of(celsius, "reflected temperature", 1, " C",
               object.reflected_temperature_k ? " as asked" : " as recorded");
  return used;
}

}  // namespace orbitfuse::measurement
