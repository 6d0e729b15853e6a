// SPDX-License-Identifier: BSD-3-Clause
#include "app/inspection/facts.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "app/pipeline/stage_record.hpp"
#include "app/stages/metric_scale.hpp"
#include "core/numeric/percent.hpp"
#include "core/temperature.hpp"

namespace orbitfuse::inspection {
namespace {
using report::Facts;

std::string or_not_recorded(const std::string& text) { return text.empty() ? not_recorded : text; }

/// What the session recorded, and what the operator says where that is something else.
std::string recorded_or_told(const std::string& recorded, const std::string& told) {
  if (recorded.empty()) return or_not_recorded(told);
  if (told.empty() || told == recorded) return recorded;
  return recorded + " as recorded; " + told + " as told by the operator";
}

std::string utc(std::int64_t ns) {
  const auto seconds = static_cast<std::time_t>(ns / 1'000'000'000);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}", fmt::gmtime(seconds));
}

/// "2026-11-22 10:03:12 to 10:09:44 UTC, 24 frames"
std::string orbit_time(const Session& session, Modality modality) {
  std::optional<std::int64_t> first, last;
  std::size_t with_time = 0, of_files = 0;
  const auto frames = session.frames_of(modality);
  for (const FrameRecord* frame : frames) {
    if (frame->host_time_ns.value_or(0) <= 0) continue;  // no frame is from before 1970
    first = std::min(first.value_or(*frame->host_time_ns), *frame->host_time_ns);
    last = std::max(last.value_or(*frame->host_time_ns), *frame->host_time_ns);
    ++with_time;
    of_files += frame->has_flag(FrameFlag::file_time);
  }
  if (!first || !last) return {};
  const std::string begin = utc(*first), end = utc(*last);
  std::string text = begin;
  if (end != begin)
    text += " to " + (end.substr(0, 10) == begin.substr(0, 10) ? end.substr(11) : end);
  text += " UTC";
  if (with_time < frames.size())
    text += fmt::format(" ({} of {} frames have a time)", with_time, frames.size());
  if (of_files > 0) text += fmt::format(" (of {} frames: when the file was written)", of_files);
  return text;
}

/// The values of all devices of a kind, each once.
std::string of_devices(const Session& session, Modality modality, std::string DeviceInfo::*what) {
  std::set<std::string> values;
  for (const DeviceInfo& device : session.devices)
    if (device.modality == modality && !(device.*what).empty()) values.insert(device.*what);
  std::string text;
  for (const std::string& value : values) text += (text.empty() ? "" : ", ") + value;
  return text;
}

/// What the frames' files say of one object parameter; empty: nothing.
std::string of_frames(const Session& session, double ObjectParameters::*what, double factor,
                      double offset, int digits, const char* unit) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  std::size_t with = 0;
  const auto frames = session.frames_of(Modality::thermal);
  for (const FrameRecord* frame : frames) {
    if (!frame->radiometry) continue;
    const double value = frame->radiometry->object.*what * factor + offset;
    low = std::min(low, value);
    high = std::max(high, value);
    ++with;
  }
  if (with == 0) return {};
  std::string text = low == high
                         ? fmt::format("{:.{}f}{}", low, digits, unit)
                         : fmt::format("{:.{}f} to {:.{}f}{}", low, digits, high, digits, unit);
  if (with < frames.size()) text += fmt::format(" ({} of {} frames)", with, frames.size());
  return text;
}

std::string told(const std::optional<double>& value, int digits, const char* unit) {
  return value ? fmt::format("{:.{}f}{}", *value, digits, unit) : "";
}

std::size_t frames_without_radiometry(const Session& session) {
  const auto frames = session.frames_of(Modality::thermal);
  return static_cast<std::size_t>(std::count_if(
      frames.begin(), frames.end(), [](const FrameRecord* f) { return !f->radiometry; }));
}

}  // namespace

Facts cover_facts(const InspectionDetails& d) {
  const auto line = [&](const char* what, const char* key) {
    return std::pair(std::string(what), or_not_recorded(d.text(key)));
  };
  Facts facts = {line("Object", "inspection.object"),
                 line("Place", "inspection.place"),
                 line("Client", "inspection.client"),
                 line("Purpose", "inspection.purpose"),
                 line("Declared standard", "inspection.standard"),
                 line("Operator", "inspection.operator"),
                 line("Qualification", "inspection.qualification")};
  if (!d.text("inspection.number").empty())
    facts.insert(facts.begin(), {"Report", d.text("inspection.number")});
  if (!d.text("inspection.remarks").empty())
    facts.emplace_back("Remarks", d.text("inspection.remarks"));
  return facts;
}

Facts camera_facts(const Session& session, const InspectionDetails& d) {
  Facts facts;
  for (const Modality modality : {Modality::thermal, Modality::visible}) {
    const std::string word(name(modality)),
        what = modality == Modality::thermal ? "Thermal camera" : "Visible camera";
    if (session.frames_of(modality).empty()) {
      facts.emplace_back(what, "no frames of it in the session");
      continue;
    }
    facts.emplace_back(what, recorded_or_told(of_devices(session, modality, &DeviceInfo::model),
                                              d.text("cameras." + word)));
    facts.emplace_back(what + ", serial number",
                       recorded_or_told(of_devices(session, modality, &DeviceInfo::serial),
                                        d.text("cameras." + word + "_serial")));
    if (modality == Modality::thermal)
      facts.emplace_back(what + ", calibrated",
                         or_not_recorded(d.text("cameras.thermal_calibrated")));
    facts.emplace_back(
        modality == Modality::thermal ? "Thermal orbit" : "Visible orbit",
        recorded_or_told(orbit_time(session, modality), d.text("cameras." + word + "_time")));
  }
  facts.emplace_back("Session", session.id + ", made " + session.created);
  return facts;
}

Facts condition_facts(const InspectionDetails& d) {
  Facts facts;
  for (const auto& [what, key] :
       {std::pair("Operating state", "conditions.operating_state"),
        std::pair("Construction and surfaces", "conditions.construction"),
        std::pair("Orientation", "conditions.orientation"),
        std::pair("Weather", "inspection.weather"),
        std::pair("Outdoor air", "conditions.outdoor_air"),
        std::pair("Indoor air", "conditions.indoor_air"),
        std::pair("Pressure difference", "conditions.pressure_difference"),
        std::pair("Sun", "conditions.sun"), std::pair("Precipitation", "conditions.precipitation"),
        std::pair("Wind", "conditions.wind")})
    facts.emplace_back(what, or_not_recorded(d.text(key)));
  return facts;
}

Facts radiometry_facts(const Session& session, const InspectionDetails& d) {
  using P = ObjectParameters;
  // What is only told was not what the temperatures were made with.
  const auto both = [](const std::string& recorded, const std::string& told_value) {
    if (!recorded.empty() || told_value.empty()) return recorded_or_told(recorded, told_value);
    return told_value + " as told by the operator; not recorded with the frames";
  };
  return {{"Emissivity",
           both(of_frames(session, &P::emissivity, 1, 0, 2, ""), told(d.emissivity, 2, ""))},
          {"Emissivity from", or_not_recorded(d.text("radiometry.emissivity_from"))},
          {"Reflected apparent temperature",
           both(of_frames(session, &P::reflected_k, 1, -273.15, 1, " °C"),
                told(d.reflected_c, 1, " °C"))},
          {"Distance for the air's correction",
           both(of_frames(session, &P::distance_m, 1, 0, 1, " m"), told(d.distance_m, 1, " m"))},
          {"Air temperature for it",
           or_not_recorded(of_frames(session, &P::atmospheric_k, 1, -273.15, 1, " °C"))},
          {"Relative humidity", both(of_frames(session, &P::relative_humidity, 100, 0, 0, " %"),
                                     told(d.humidity_percent, 0, " %"))}};
}

namespace {

void add_pose_limits(const Session& session, const view::FinishedRun& run,
                     std::vector<std::string>& limits) {
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    std::vector<std::string> doubtful;
    std::set<std::string> posed;
    for (const view::RecordedView& v : run.views) {
      if (v.modality != modality) continue;
      posed.insert(v.view.name);
      if (v.doubt) doubtful.push_back(v.view.name + " (" + *v.doubt + ")");
    }
    const auto frames = session.frames_of(modality);
    const auto missing = std::count_if(frames.begin(), frames.end(), [&](const FrameRecord* f) {
      return !posed.contains(f->file);
    });
    if (missing > 0)
      limits.push_back(fmt::format("{} of {} {} frames have no pose: nothing was read from them.",
                                   missing, frames.size(), name(modality)));
    std::string list;
    for (const std::string& one : doubtful) list += (list.empty() ? "" : "; ") + one;
    if (!doubtful.empty())
      limits.push_back(fmt::format("{} of {} posed {} views {}: {}.", doubtful.size(), posed.size(),
                                   name(modality),
                                   doubtful.size() == 1 ? "is doubtful and counts for less"
                                                        : "are doubtful and count for less",
                                   list));
  }
}

void add_radiometry_limits(const Session& session, const InspectionDetails& d,
                           std::vector<std::string>& limits) {
  if (d.text("cameras.thermal_calibrated").empty())
    limits.emplace_back(
        "No calibration of the thermal camera is recorded: its own error is in no uncertainty "
        "here, and absolute temperatures may be off by more than is stated.");
  const std::size_t without = frames_without_radiometry(session);
  if (without > 0)
    limits.push_back(fmt::format(
        "{} of {} thermal frames hold temperatures without the object parameters that they were "
        "computed with: they stand as the camera gave them.",
        without, session.frames_of(Modality::thermal).size()));
  const auto differs = [&](const std::optional<double>& told_value, double ObjectParameters::*what,
                           double offset, double tolerance) {
    const auto frames = session.frames_of(Modality::thermal);
    return told_value && std::any_of(frames.begin(), frames.end(), [&](const FrameRecord* f) {
             return f->radiometry &&
                    std::abs(f->radiometry->object.*what + offset - *told_value) > tolerance;
           });
  };
  if (differs(d.emissivity, &ObjectParameters::emissivity, 0, 0.005) ||
      differs(d.reflected_c, &ObjectParameters::reflected_k, -273.15, 0.05))
    limits.emplace_back(
        "The operator's emissivity or reflected temperature is not the recorded one. What is "
        "described there is not applied: each finding says what it was computed with.");
}

/// How much of what the run shows has a temperature.
void add_coverage(const view::FinishedRun& run, std::vector<std::string>& limits) {
  const auto record = pipeline::read_stage_record(run.out / "fuse");
  if (!record) return;  // nothing was fused
  const auto share = record->output.metrics.find("measured_share");
  if (share == record->output.metrics.end() || !share->is_number()) return;
  limits.push_back(fmt::format("Of the pixels of the run's new views {} have a temperature.",
                               percent(share->get<double>())));
}

void add_finding_limits(const std::vector<InspectionFinding>& findings,
                        std::vector<std::string>& limits) {
  for (const InspectionFinding& f : findings) {
    const auto& r = f.reading();
    if (f.answer.kind == measurement::Kind::distance) continue;
    const std::string which = fmt::format("Finding {} ({}): ", f.number, f.title);
    if (!r.seen())
      limits.push_back(which + "no thermal frame saw it, so that it has no measured temperature.");
    else if (r.points > r.seen_points)
      limits.push_back(which + "thermal frames saw " + percent(r.seen_share) + " of its area.");
    if (r.seen() && std::all_of(r.frames.begin(), r.frames.end(),
                                [](const auto& line) { return line.doubtful; }))
      limits.push_back(which + "only views with doubtful poses saw it.");
    if (f.comparison && !f.comparison->known())
      limits.push_back(which + "it can't be compared: " +
                       (f.comparison->reference_gone ? "its reference is no longer saved."
                                                     : "no thermal frame saw one of the two."));
  }
}

}  // namespace

std::vector<std::string> limits_of(const Session& session, const view::FinishedRun& run,
                                   const InspectionDetails& details,
                                   const std::vector<InspectionFinding>& findings) {
  std::vector<std::string> limits;
  add_pose_limits(session, run, limits);
  add_coverage(run, limits);
  add_finding_limits(findings, limits);
  add_radiometry_limits(session, details, limits);
  if (!session.complete)
    limits.emplace_back("The recording was not closed properly: its last frames may be missing.");
  limits.emplace_back(
      "Only what the thermal orbit saw was measured. Surfaces that no frame saw, the underside and "
      "what stood hidden, were not inspected.");
  limits.push_back(stages::scale_words(stages::scale_of_run(run.out)) + ". No north is known.");
  for (const std::string& note : run.notes) limits.push_back(note + ".");
  return limits;
}

}  // namespace orbitfuse::inspection
