// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/formats/csv.hpp"
#include "core/temperature.hpp"

namespace orbitfuse::measurement {
namespace {

std::string number(double value, int digits = 3) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : "";
}
std::string celsius(double kelvin) { return number(celsius_from_kelvin(kelvin)); }

struct Row {
  std::string name, kind;
  std::optional<Eigen::Vector3d> position = {};
  const TemperatureReading* reading = nullptr;
  double along = unknown, distance = unknown, distance_uncertainty = unknown, distance_m = unknown,
         distance_uncertainty_m = unknown, difference_k = unknown,
         difference_uncertainty_k = unknown, emissivity = unknown;
  std::string note = {};
};

std::string line(const Row& row) {
  static const TemperatureReading none;
  const TemperatureReading& r = row.reading != nullptr ? *row.reading : none;
  const FrameLine* best = r.best();
  const auto at = [&](int i) { return row.position ? number((*row.position)[i], 5) : ""; };
  return fmt::format(
      "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
      csv_text(row.name), row.kind, celsius(r.temperature_k), number(r.uncertainty_k),
      celsius(r.field_k), celsius(r.mean_k), celsius(r.min_k), celsius(r.max_k),
      number(r.standard_deviation_k), number(r.spread_k),
      row.reading != nullptr ? fmt::format("{}", r.frames.size()) : "", number(r.angle_deg, 1),
      at(0), at(1), at(2), number(row.along, 5), number(row.distance, 5),
      number(row.distance_uncertainty, 5), number(row.distance_m, 4),
      number(row.distance_uncertainty_m, 4), number(row.difference_k),
      number(row.difference_uncertainty_k), best != nullptr ? csv_text(best->frame) : "",
      number(best != nullptr ? best->pixel.x() : unknown, 1),
      number(best != nullptr ? best->pixel.y() : unknown, 1), number(row.emissivity),
      csv_text(row.note));
}

std::string joined(const std::vector<std::string>& notes) {
  std::string text;
  for (const std::string& note : notes) text += (text.empty() ? "" : "; ") + note;
  return text;
}

}  // namespace

std::string notes_of(const Answer& answer, std::size_t spot) {
  std::vector<std::string> notes = answer.spots[spot].notes;
  for (const std::string& note : answer.notes) {
    bool of_a_place = false;
    for (std::size_t i = 0; i < answer.spots.size(); ++i)
      for (const std::string& own : answer.spots[i].notes)
        of_a_place = of_a_place || note == place_words(i) + own;
    if (!of_a_place) notes.push_back(note);
  }
  return joined(notes);
}
std::string notes_of(const Answer& answer) { return joined(answer.notes); }

std::string csv_header() {
  return "name,kind,temperature_c,uncertainty_k,field_c,mean_c,min_c,max_c,standard_deviation_k,"
         "spread_k,frames,angle_deg,x,y,z,along,distance,distance_uncertainty,distance_m,"
         "distance_uncertainty_m,difference_k,difference_uncertainty_k,best_view,best_u,best_v,"
         "emissivity,note";
}

std::vector<std::string> csv_rows(const std::string& name, const Answer& answer) {
  const std::string kind(measurement::name(answer.kind));
  std::vector<std::string> rows;
  Row row{.name = name,
          .kind = kind,
          .position = answer.position,
          .emissivity = answer.radiometry.emissivity,
          .note = notes_of(answer)};
  switch (answer.kind) {
    case Kind::hottest:
    case Kind::coldest:
      for (std::size_t i = 0; i < answer.spots.size(); ++i)
        rows.push_back(line({.name = fmt::format("{} {}", name, i + 1),
                             .kind = kind,
                             .position = answer.spots[i].position,
                             .reading = &answer.spots[i].reading,
                             .emissivity = row.emissivity,
                             .note = notes_of(answer, i)}));
      return rows;
    case Kind::difference:
      row.difference_k = answer.difference_k;
      row.difference_uncertainty_k = answer.difference_uncertainty_k;
      rows.push_back(line(row));
      for (std::size_t i = 0; i < answer.of.size(); ++i)
        for (std::string& part : csv_rows(fmt::format("{} of {}", i + 1, name), answer.of[i]))
          rows.push_back(std::move(part));
      return rows;
    case Kind::distance:
      row.distance = answer.distance;
      row.distance_uncertainty = answer.distance_uncertainty;
      row.distance_m = answer.distance_m.value_or(unknown);
      row.distance_uncertainty_m = answer.distance_uncertainty_m;
      return {line(row)};
    default:
      row.reading = &answer.reading;
      rows.push_back(line(row));
      for (const ProfilePoint& point : answer.profile) {
        Row at{
            .name = name, .kind = "line point", .along = point.along, .emissivity = row.emissivity};
        if (point.at) at.position = point.at->position, at.reading = &point.at->reading;
        rows.push_back(line(at));
      }
      return rows;
  }
}

std::string described(const TemperatureReading& r) {
  if (!r.seen())
    return fmt::format("not measured{}",
                       std::isfinite(r.field_k)
                           ? fmt::format(" (field {:.2f} C)", celsius_from_kelvin(r.field_k))
                           : "");
  std::string text = fmt::format(
      "{:.2f} C +- {:.2f}, of which {:.2f} assumed for the camera ({} frame{} {:.2f} to {:.2f}",
      celsius_from_kelvin(r.temperature_k), r.uncertainty_k, r.assumed_k, r.frames.size(),
      r.frames.size() == 1 ? "" : "s", celsius_from_kelvin(r.min_k), celsius_from_kelvin(r.max_k));
  if (std::isfinite(r.field_k))
    text += fmt::format("; field {:.2f}", celsius_from_kelvin(r.field_k));
  text += fmt::format("; seen {:.0f} deg from the normal)", r.angle_deg);
  const FrameLine* best = r.best();
  return text + fmt::format(", best seen at {},{:.1f},{:.1f}", best->frame, best->pixel.x(),
                            best->pixel.y());
}

namespace {

/// Some points of a profile, from its start to its end.
std::string described(const std::vector<ProfilePoint>& profile) {
  constexpr std::size_t most = 9;
  const std::size_t shown = std::min(most, profile.size());
  std::string text = "profile in C:";
  for (std::size_t i = 0; i < shown; ++i) {
    const auto& at = profile[shown < 2 ? 0 : i * (profile.size() - 1) / (shown - 1)].at;
    const bool seen = at && at->reading.seen();
    text += seen ? fmt::format(" {:.1f}", celsius_from_kelvin(at->reading.temperature_k)) : " -";
  }
  return text + fmt::format(" ({} of its {} points; all with where they lie: --csv or --json)",
                            shown, profile.size());
}

}  // namespace

std::vector<std::string> described(const Answer& answer) {
  const auto at = [](const Eigen::Vector3d& p) {
    return fmt::format("; at {:.4f},{:.4f},{:.4f}", p.x(), p.y(), p.z());
  };
  std::vector<std::string> lines;
  switch (answer.kind) {
    case Kind::hottest:
    case Kind::coldest:
      for (std::size_t i = 0; i < answer.spots.size(); ++i)
        lines.push_back(fmt::format("{:>3} {}{}", i + 1, described(answer.spots[i].reading),
                                    at(answer.spots[i].position)));
      break;
    case Kind::difference:
      for (const Answer& part : answer.of)
        for (std::string& text : described(part)) lines.push_back("    " + std::move(text));
      if (std::isfinite(answer.difference_k))
        lines.push_back(fmt::format("difference {:+.2f} K +- {:.2f}", answer.difference_k,
                                    answer.difference_uncertainty_k));
      break;
    case Kind::distance:
      lines.push_back(distance_words(answer));
      break;
    default:
      lines.push_back(described(answer.reading) + (answer.position ? at(*answer.position) : ""));
      if (!answer.profile.empty()) lines.push_back(described(answer.profile));
  }
  if (!answer.radiometry.words.empty()) lines.push_back(answer.radiometry.words);
  for (const std::string& note : answer.notes) lines.push_back("note: " + note);
  return lines;
}

}  // namespace orbitfuse::measurement
