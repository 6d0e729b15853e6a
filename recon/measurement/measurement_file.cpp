// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/measurement_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"
#include "core/system/folder_change_lock.hpp"
#include "core/system/utc_now.hpp"
#include "recon/measurement/answer.hpp"

namespace orbitfuse::measurement {
namespace {
using nlohmann::json;

constexpr const char* put_away = "nothing was changed: mend it, or move it away and measure again";

tl::unexpected<Error> damaged(const std::filesystem::path& file, const std::string& found) {
  return fail(ErrorKind::input, file.string(), found, put_away);
}

/// Earlier versions took more places at once. What was found stays; asked again, it is fewer.
bool fit_count(json& request) {
  bool fitted = false;
  if (!request.is_object()) return fitted;
  if (const auto count = request.find("count");
      count != request.end() && count->is_number_integer() && *count > most_places) {
    *count = most_places;
    fitted = true;
  }
  if (const auto of = request.find("of"); of != request.end() && of->is_array())
    for (json& part : *of) fitted = fit_count(part) || fitted;
  return fitted;
}

constexpr std::pair<const char*, std::string SavedMeasurement::*> word_fields[] = {
    {"remark", &SavedMeasurement::remark},
    {"component", &SavedMeasurement::component},
    {"reference", &SavedMeasurement::reference}};

/// What is measured, apart from its name and the object parameters.
json place_asked(const Request& request) {
  json place = to_json(request);
  for (const char* other : {"name", "object", "recorded"}) place.erase(other);
  if (place.contains("of")) {
    place["of"] = json::array();
    for (const Request& part : request.of) place["of"].push_back(place_asked(part));
  }
  return place;
}

Status read_words(const json& j, const std::string& where, SavedMeasurement& saved) {
  for (const auto& [key, words] : word_fields) {
    if (!j.contains(key)) continue;
    if (!j[key].is_string())
      return fail(ErrorKind::input, where + "." + key, "not a text", put_away);
    saved.*words = j[key].get<std::string>();
  }
  return {};
}

Result<SavedMeasurement> parse(const json& j, const std::string& where,
                               std::vector<std::string>& notes) {
  SavedMeasurement saved;
  if (!j.is_object() || !j.contains("name") || !j["name"].is_string() || j["name"] == "")
    return fail(ErrorKind::input, where, "no name in it", put_away);
  saved.name = j["name"];
  if (j.contains("created") && j["created"].is_string()) saved.created = j["created"];
  if (!j.contains("request")) return fail(ErrorKind::input, where, "no request in it", put_away);
  json asked = j["request"];
  if (fit_count(asked))
    notes.push_back(
        fmt::format("{} '{}': asked for more than {} places, as earlier versions "
                    "could; all that were found are kept",
                    where, saved.name, most_places));
  const auto request = request_of_json(asked);
  if (!request)
    return fail(ErrorKind::input, where + ": " + request.error().where, request.error().found,
                put_away);
  saved.request = *request;
  if (!j.contains("answer") || !j["answer"].is_object())
    return fail(ErrorKind::input, where, "no answer in it", put_away);
  saved.answer = j["answer"];
  if (const auto answer = answer_of_json(saved.answer); !answer)
    return fail(ErrorKind::input,
                fmt::format("{}: '{}': {}", where, saved.name, answer.error().where),
                answer.error().found, put_away);
  ORBITFUSE_TRY(read_words(j, where, saved));
  return saved;
}

}  // namespace

json to_json(const SavedMeasurement& saved) {
  json entry = {{"name", saved.name},
                {"created", saved.created},
                {"request", to_json(saved.request)},
                {"answer", saved.answer}};
  for (const auto& [key, words] : word_fields)
    if (!(saved.*words).empty()) entry[key] = saved.*words;
  return entry;
}

Status check_name(const std::string& name) {
  if (std::any_of(name.begin(), name.end(),
                  [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }))
    return fail(ErrorKind::usage, "the measurement's name", "a line break or control character",
                "choose one that fits on a line");
  if (name.size() <= longest_name_bytes) return {};
  return fail(ErrorKind::usage, "the measurement's name", fmt::format("{} bytes long", name.size()),
              fmt::format("choose one of up to {} bytes (letters beyond ASCII have two to four)",
                          longest_name_bytes));
}

const SavedMeasurement* Measurements::find(const std::string& name) const {
  const auto at = std::find_if(list.begin(), list.end(),
                               [&](const SavedMeasurement& m) { return m.name == name; });
  return at == list.end() ? nullptr : &*at;
}

Kept Measurements::put(SavedMeasurement measurement) {
  const std::string_view kind = measurement::name(measurement.request.kind);
  for (int i = 1; measurement.name.empty(); ++i) {
    const std::string name = fmt::format("{} {}", kind, i);
    if (find(name) == nullptr) measurement.name = name;
  }
  measurement.request.name = measurement.name;
  Kept kept{measurement.name, false};
  const auto at = std::find_if(list.begin(), list.end(),
                               [&](const SavedMeasurement& m) { return m.name == kept.name; });
  if (at == list.end()) {
    list.push_back(std::move(measurement));
    return kept;
  }
  const bool same = place_asked(measurement.request) == place_asked(at->request);
  for (const auto& [what, words] : word_fields) {
    if (((*at).*words).empty() || !(measurement.*words).empty()) continue;
    if (same) measurement.*words = (*at).*words;
    kept.words += fmt::format("{}{} '{}' {}", kept.words.empty() ? "" : ", ", what, (*at).*words,
                              same ? "stays" : "went with the place that it was said of");
  }
  *at = std::move(measurement);
  kept.replaced = true;
  return kept;
}

Result<Measurements> load_measurements(const std::filesystem::path& file,
                                       const std::string& identity) {
  Measurements result;
  result.identity = identity;
  std::error_code unreadable;  // read_file says why
  if (!std::filesystem::exists(file, unreadable) && !unreadable) return result;
  ORBITFUSE_ASSIGN(const std::string text, read_file(file, max_text_bytes));
  const json j = parse_json(text);
  if (!j.is_object())
    return damaged(file, j.is_discarded() ? json_fault(text) : "not a JSON object");
  if (!j.contains("schema") || j["schema"] != measurement_schema)
    return damaged(file, fmt::format("schema {}, this program writes {}",
                                     j.contains("schema") ? j["schema"].dump() : "missing",
                                     measurement_schema));
  if (!j.contains("run") || !j["run"].is_string()) return damaged(file, "no run named in it");
  if (j["run"] != identity)
    return fail(ErrorKind::input, file.string(),
                "measurements of another run: poses or fields have been made anew since",
                "nothing was changed: move the file away to keep it, and measure again");
  if (!j.contains("measurements") || !j["measurements"].is_array())
    return damaged(file, "no list of measurements in it");
  std::set<std::string> names;
  for (const json& entry : j["measurements"]) {
    const std::string where =
        fmt::format("{}: measurements[{}]", file.string(), result.list.size());
    ORBITFUSE_ASSIGN(SavedMeasurement saved, parse(entry, where, result.notes));
    if (!names.insert(saved.name).second)
      return damaged(file, "two measurements named '" + saved.name + "'");
    result.list.push_back(std::move(saved));
  }
  return result;
}

void bring_to_scale(Measurements& saved, std::optional<double> metres_per_unit,
                    double relative_sigma) {
  for (SavedMeasurement& m : saved.list) {
    if (m.request.kind != Kind::distance || !m.answer.is_object()) continue;
    const auto units = m.answer.find("distance");
    if (units == m.answer.end() || !units->is_number()) continue;
    m.answer["distance_m"] = m.answer["distance_uncertainty_m"] = json();
    json notes = json::array();
    if (const auto said = m.answer.find("notes"); said != m.answer.end() && said->is_array())
      for (const json& note : *said)
        if (note != no_scale_note && note != ends_unknown_note) notes.push_back(note);
    if (!metres_per_unit) notes.push_back(no_scale_note);
    m.answer["notes"] = notes;
    if (!metres_per_unit) continue;
    const auto uncertain = m.answer.find("distance_uncertainty");
    const bool ends_known = uncertain != m.answer.end() && uncertain->is_number();
    if (!ends_known) m.answer["notes"].push_back(ends_unknown_note);
    m.answer["distance_m"] = units->get<double>() * *metres_per_unit;
    m.answer["distance_uncertainty_m"] = distance_uncertainty_m(
        units->get<double>(), ends_known ? uncertain->get<double>() : unknown, *metres_per_unit,
        relative_sigma);
  }
}

Result<Kept> add_measurement(const std::filesystem::path& file, const std::string& identity,
                             SavedMeasurement measurement) {
  ORBITFUSE_TRY(check_name(measurement.name));
  FolderChangeLock lock;
  ORBITFUSE_TRY(lock.acquire(file.parent_path()));
  ORBITFUSE_ASSIGN(Measurements all, load_measurements(file, identity));
  if (measurement.created.empty()) measurement.created = utc_now_text();
  Kept kept = all.put(std::move(measurement));
  ORBITFUSE_TRY(save_measurements(file, all));
  return kept;
}

Status remove_measurement(const std::filesystem::path& file, const std::string& identity,
                          const std::string& name) {
  FolderChangeLock lock;
  ORBITFUSE_TRY(lock.acquire(file.parent_path()));
  ORBITFUSE_ASSIGN(Measurements all, load_measurements(file, identity));
  if (std::erase_if(all.list, [&](const SavedMeasurement& m) { return m.name == name; }) == 0)
    return fail(ErrorKind::input, file.string(), "no measurement named '" + name + "'",
                "look at what is saved: another program may have removed it");
  return save_measurements(file, all);
}

Status save_measurements(const std::filesystem::path& file, const Measurements& measurements) {
  json list = json::array();
  for (const SavedMeasurement& saved : measurements.list) list.push_back(to_json(saved));
  const json j = {{"schema", measurement_schema},
                  {"conventions",
                   {{"frame",
                     "the visible reconstruction's world; the thermal one's in a run "
                     "without visible poses"},
                    {"length", "units of that world, which are free; *_m: metres"},
                    {"temperature", "kelvin"},
                    {"pixel", "the centre of the top-left pixel is (0.5, 0.5)"},
                    {"uncertainty", "covers the error in 90 of 100 cases"}}},
                  {"run", measurements.identity},
                  {"measurements", list}};
  const std::string text = j.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
  // What is larger could be written, and never be read again.
  if (text.size() > max_text_bytes)
    return fail(ErrorKind::input, file.string(),
                fmt::format("{} measurements of {} MB together, it may hold {} MB",
                            measurements.list.size(), text.size() >> 20, max_text_bytes >> 20),
                "nothing was changed: move the file away to keep it, and measure again");
  return write_file_atomic(file, text);
}

}  // namespace orbitfuse::measurement
