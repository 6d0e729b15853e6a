// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/reradiometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "core/temperature.hpp"

namespace orbitfuse::measurement {
namespace {

/// Assumed where a user tells the emissivity of the recording and nothing else.
constexpr double assumed_reflected_k = 293.15;

/// A grey body at one wavelength: S = 1 / (e^(B/T) - 1). B = c2 / 10 um; long-wave cameras have
/// 1380 to 1510 K.
constexpr PlanckConstants ten_micrometres{.r1 = 1, .r2 = 1, .b = 1438.8, .f = 1, .o = 0};

Result<FlirCalibration> recorded_with(const ThermalFrame& frame,
                                      const ObjectParameterOverrides& said) {
  if (frame.radiometry) return *frame.radiometry;
  if (!said.emissivity)
    return fail(ErrorKind::usage, recorded_unknown,
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
        *recorded.emissivity,
        recorded.reflected_temperature_k.value_or(assumed_reflected_k) - 273.15);
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

/// What frames have of one parameter, and where from.
struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  int known = 0, frames = 0;
  const char* source = " as recorded";
  void add(const std::optional<double>& value) {
    ++frames;
    if (!value) return;
    ++known;
    low = std::min(low, *value), high = std::max(high, *value);
  }
  double same() const { return known == frames && low == high ? low : unknown; }
};

std::string words_of(const Range& r, const char* what, int digits, const char* unit) {
  if (r.known == 0) return fmt::format("{} not recorded", what);
  std::string text = fmt::format("{} {:.{}f}", what, r.low, digits);
  if (r.low != r.high) text += fmt::format(" to {:.{}f}", r.high, digits);
  text += fmt::format("{}{}", unit, r.source);
  if (r.known < r.frames) text += fmt::format(" in {} of {} frames", r.known, r.frames);
  return text;
}

}  // namespace

UsedParameters used_parameters(const std::vector<ThermalFrame>& frames,
                               const ObjectParameterOverrides& object,
                               const ObjectParameterOverrides& recorded) {
  Range emissivity, reflected_k;
  const auto note = [](Range& range, const std::optional<double>& asked,
                       const std::optional<double>& of_frame, const std::optional<double>& told,
                       const char* told_words) {
    if (asked)
      range.source = " as asked";
    else if (!of_frame && told)
      range.source = told_words;
    range.add(asked ? asked : of_frame ? of_frame : told);
  };
  const std::optional<double> assumed =
      recorded.emissivity ? std::optional(assumed_reflected_k) : std::nullopt;
  for (const ThermalFrame& frame : frames) {
    const auto known = [&](double ObjectParameters::*of) {
      return frame.radiometry ? std::optional(frame.radiometry->object.*of) : std::nullopt;
    };
    note(emissivity, object.emissivity, known(&ObjectParameters::emissivity), recorded.emissivity,
         " as told of the recording");
    note(reflected_k, object.reflected_temperature_k, known(&ObjectParameters::reflected_k),
         recorded.reflected_temperature_k ? recorded.reflected_temperature_k : assumed,
         recorded.reflected_temperature_k ? " as told of the recording" : " assumed");
  }
  UsedParameters used;
  if (frames.empty()) return used;
  used.emissivity = emissivity.same();
  used.reflected_k = reflected_k.same();
  if (emissivity.known == 0 && reflected_k.known == 0) {
    used.words = "emissivity not recorded: temperatures as the camera gave them";
    return used;
  }
  Range celsius = reflected_k;
  celsius.low = celsius_from_kelvin(celsius.low);
  celsius.high = celsius_from_kelvin(celsius.high);
  used.words = words_of(emissivity, "emissivity", 2, "") + ", " +
               words_of(celsius, "reflected temperature", 1, " C");
  return used;
}

}  // namespace orbitfuse::measurement
