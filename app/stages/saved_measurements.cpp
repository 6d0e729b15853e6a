// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/saved_measurements.hpp"

#include <fmt/format.h>

#include <cmath>

#include "app/stages/measurement_scene.hpp"
#include "core/temperature.hpp"
#include "recon/measurement/table.hpp"

namespace orbitfuse::stages {
namespace fs = std::filesystem;
using measurement::Answer;
using measurement::Kind;
using measurement::SavedMeasurement;

std::string number_words(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : "";
}

std::string celsius_words(double kelvin, int digits) {
  return number_words(celsius_from_kelvin(kelvin), digits);
}

std::vector<ReadPlace> places_of(const std::string& name, const Answer& answer) {
  std::vector<ReadPlace> places;
  switch (answer.kind) {
    case Kind::distance:
      return places;
    case Kind::hottest:
    case Kind::coldest:
      for (std::size_t i = 0; i < answer.spots.size(); ++i)
        places.push_back(
            {answer.spots.size() == 1 ? name : fmt::format("{}, place {}", name, i + 1),
             &answer.spots[i].reading, answer.spots[i].position, notes_of(answer, i)});
      return places;
    case Kind::difference:
      for (std::size_t i = 0; i < answer.of.size(); ++i)
        for (ReadPlace& part : places_of(
                 fmt::format("{}, {}", name, i == 0 ? "the first" : "the second"), answer.of[i]))
          places.push_back(std::move(part));
      return places;
    default:
      places.push_back({name, &answer.reading, answer.position, notes_of(answer)});
      return places;
  }
}

namespace {

/// The user's, then the program's.
std::string remarks(const SavedMeasurement& saved, const std::string& notes) {
  return saved.remark + (saved.remark.empty() || notes.empty() ? "" : "; ") + notes;
}

std::vector<std::string> row_of(const ReadPlace& place, const SavedMeasurement& saved,
                                const std::string& parameters) {
  const measurement::TemperatureReading& r = *place.reading;
  const measurement::FrameLine* best = r.best();
  return {place.name,
          std::string(measurement::name(saved.request.kind)),
          r.seen() ? celsius_words(r.temperature_k, 2) : "no frame sees it",
          r.seen() ? number_words(r.uncertainty_k, 2) : "",
          celsius_words(r.field_k, 2),
          fmt::format("{}", r.frames.size()),
          number_words(r.angle_deg, 0),
          best != nullptr
              ? fmt::format("{} at {:.0f},{:.0f}", best->frame, best->pixel.x(), best->pixel.y())
              : "",
          parameters,
          remarks(saved, place.notes)};
}

std::vector<std::string> other_row(const SavedMeasurement& saved, const Answer& answer) {
  std::vector<std::string> row(10);
  row[0] = saved.name;
  row[1] = measurement::name(answer.kind);
  row[9] = remarks(saved, notes_of(answer));
  if (answer.kind == Kind::difference) {
    row[2] = std::isfinite(answer.difference_k) ? fmt::format("{:+.2f} K", answer.difference_k)
                                                : "no frame sees both";
    row[3] = number_words(answer.difference_uncertainty_k, 2);
  } else {
    row[2] = measurement::distance_words(answer, "±");
  }
  return row;
}

}  // namespace

Result<report::Table> measurement_table(const fs::path& out, const Session& session) {
  const fs::path file = out / measurement::measurements_file;
  report::Table table{
      "",
      {{"Measurement", "As it is called in measurements.json of the run"},
       {"Kind", ""},
       {"Temperature (°C)", "Weighted mean of the original frames that see the place"},
       {"± (K)", std::string("It ") + measurement::uncertainty_words},
       {"Field (°C)", "Of the trained thermal field, beside the frames'"},
       {"Frames", "Original thermal frames that see the place"},
       {"Angle (°)", "Of the line of sight to the surface's normal, mean over the frames"},
       {"Best seen in", "The frame that sees it finest and straightest, and the pixel there"},
       {"Object parameters", "What the temperatures were computed with"},
       {"Remark", ""}},
      {}};
  std::error_code unreadable;
  if (!fs::exists(file, unreadable) && !unreadable) return table;
  ORBITFUSE_ASSIGN(const std::string identity, measurement_identity(out, session));
  ORBITFUSE_ASSIGN(measurement::Measurements saved, measurement::load_measurements(file, identity));
  const auto scale = scale_of_run(out);  // the report says elsewhere what is wrong with it
  if (scale && *scale)
    bring_to_scale(saved, (*scale)->metres_per_unit, (*scale)->relative_uncertainty);
  else
    bring_to_scale(saved, std::nullopt, 0);
  for (const SavedMeasurement& m : saved.list) {
    const auto answer = measurement::answer_of_json(m.answer);
    if (!answer)
      return fail(ErrorKind::input,
                  fmt::format("{}: '{}': {}", file.string(), m.name, answer.error().where),
                  answer.error().found, answer.error().remedy);
    const bool alone = answer->kind == Kind::difference || answer->kind == Kind::distance;
    if (alone) table.rows.push_back(other_row(m, *answer));
    for (const ReadPlace& place : places_of(m.name, *answer))
      table.rows.push_back(row_of(place, m, answer->radiometry.words));
  }
  return table;
}

}  // namespace orbitfuse::stages
