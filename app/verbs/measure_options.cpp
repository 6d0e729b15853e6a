// SPDX-License-Identifier: BSD-3-Clause
#include "app/verbs/measure_options.hpp"

#include <fmt/format.h>

#include <charconv>

#include "app/cli/option_pairs.hpp"
#include "app/cli/typed_options.hpp"
#include "core/nested_text.hpp"
#include "core/temperature.hpp"

namespace orbitfuse::cli {
namespace {
using measurement::Kind;
using measurement::Measurements;
using measurement::PixelPlace;
using measurement::Place;
using measurement::Request;
using measurement::ThermalScene;

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts{""};
  for (const char c : text) {
    if (c == ',')
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

std::optional<double> number(const std::string& text) {
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || at != end) return std::nullopt;
  return value;
}

tl::unexpected<Error> wrong_word(const std::string& option, const std::string& word,
                                 const std::string& form) {
  return fail(ErrorKind::usage, option, "'" + word + "'", "write " + form);
}

Result<std::vector<double>> numbers_of(const std::string& option, const std::string& word,
                                       const std::vector<std::size_t>& counts,
                                       const std::string& form) {
  std::vector<double> values;
  for (const std::string& part : split(word)) {
    const auto value = number(part);
    if (!value) return wrong_word(option, word, form);
    values.push_back(*value);
  }
  for (const std::size_t count : counts)
    if (values.size() == count) return values;
  return wrong_word(option, word, form);
}

Result<Place> pixel_of(const std::string& option, const std::string& word) {
  constexpr const char* form = "VIEW,U,V, e.g. thermal/000003.tiff,320.5,240.5";
  const std::vector<std::string> parts = split(word);
  if (parts.size() != 3 || parts[0].empty()) return wrong_word(option, word, form);
  const auto u = number(parts[1]), v = number(parts[2]);
  if (!u || !v) return wrong_word(option, word, form);
  return PixelPlace{parts[0], {*u, *v}};
}

Result<Place> point_of(const std::string& option, const std::string& word) {
  ORBITFUSE_ASSIGN(const auto v, numbers_of(option, word, {3}, "X,Y,Z, e.g. 0.1,-0.2,0.05"));
  return Eigen::Vector3d(v[0], v[1], v[2]);
}

/// A word that may be a pixel, a point, or the name of a saved measurement.
Result<Request> spot_or_saved(const std::string& option, const std::string& word,
                              const ThermalScene& scene, const Measurements& saved) {
  if (const auto* known = saved.find(word)) {
    if (known->request.kind != Kind::polygon) return known->request;
    return fail(ErrorKind::usage, option, "'" + word + "' is a polygon in a view",
                "ask for it again with --polygon: the run may have rendered other views since");
  }
  Request request;
  const std::vector<std::string> parts = split(word);
  if (parts.size() != 3)
    return wrong_word(option, word, "VIEW,U,V, or X,Y,Z, or the name of a saved measurement");
  // "000" is the name of a rendered view before it is a number.
  const bool pixel = scene.has_view(parts[0]) || names_new_view(parts[0]) || !number(parts[0]);
  ORBITFUSE_ASSIGN(Place place, pixel ? pixel_of(option, word) : point_of(option, word));
  request.places = {std::move(place)};
  return request;
}

Result<std::vector<Place>> two_places(const std::string& option,
                                      const std::vector<std::string>& words,
                                      const ThermalScene& scene, const Measurements& saved) {
  std::vector<Place> places;
  for (const std::string& word : words) {
    ORBITFUSE_ASSIGN(const Request spot, spot_or_saved(option, word, scene, saved));
    if (spot.kind != Kind::spot)
      return fail(ErrorKind::usage, option, "'" + word + "' is no spot", "name a spot or a place");
    places.push_back(spot.places.at(0));
  }
  return places;
}

Result<Request> polygon_of(const std::string& word) {
  constexpr const char* form = "VIEW,U,V,U,V,U,V with three corners or more";
  const std::vector<std::string> parts = split(word);
  if (parts.size() < 7 || parts.size() % 2 == 0) return wrong_word("--polygon", word, form);
  Request request;
  request.kind = Kind::polygon;
  for (std::size_t i = 1; i + 1 < parts.size(); i += 2) {
    const auto u = number(parts[i]), v = number(parts[i + 1]);
    if (!u || !v) return wrong_word("--polygon", word, form);
    request.places.push_back(PixelPlace{parts[0], {*u, *v}});
  }
  return request;
}

Result<Request> box_of(const std::string& word) {
  ORBITFUSE_ASSIGN(
      const auto v,
      numbers_of("--box", word, {6, 10},
                 "CX,CY,CZ,SX,SY,SZ (middle and sides), and QW,QX,QY,QZ if it is turned"));
  Request request;
  request.kind = Kind::box;
  request.box.center = {v[0], v[1], v[2]};
  request.box.size = {v[3], v[4], v[5]};
  if (v.size() == 10) request.box.rotation = Eigen::Quaterniond(v[6], v[7], v[8], v[9]);
  return request;
}

Result<Request> json_request(const std::string& text) {
  const nlohmann::json j = parse_json(text);
  if (j.is_discarded())
    return fail(ErrorKind::usage, "--request", json_fault(text), "docs/formats.md has the form");
  return measurement::request_of_json(j);
}

/// Object parameters that were typed, in the library's units.
void add_parameters(const MeasureWords& words, Request& request) {
  for (Request& part : request.of) add_parameters(words, part);
  if (request.kind == Kind::difference) return;  // has none of its own
  const auto kelvin = [](std::optional<double> celsius) {
    return celsius ? std::optional(kelvin_from_celsius(*celsius)) : std::nullopt;
  };
  ObjectParameterOverrides& o = request.object;
  if (words.emissivity) o.emissivity = words.emissivity;
  if (words.distance_m) o.distance_m = words.distance_m;
  if (words.reflected_c) o.reflected_temperature_k = kelvin(words.reflected_c);
  if (words.air_c) o.atmospheric_temperature_k = kelvin(words.air_c);
  if (words.humidity_percent) o.relative_humidity = *words.humidity_percent / 100;
  if (words.recorded_emissivity) request.recorded.emissivity = words.recorded_emissivity;
  if (words.recorded_reflected_c)
    request.recorded.reflected_temperature_k = kelvin(words.recorded_reflected_c);
}

/// In degrees and percent, as they were typed; the library has kelvin and shares.
Status check_ranges(const MeasureWords& w) {
  return check_typed({{"--emissivity", w.emissivity, emissivity_range},
                      {"--reflected-c", w.reflected_c, reflected_c_range},
                      {"--distance-m", w.distance_m, distance_m_range},
                      {"--air-c", w.air_c, air_c_range},
                      {"--humidity", w.humidity_percent, humidity_percent_range},
                      {"--recorded-emissivity", w.recorded_emissivity, emissivity_range},
                      {"--recorded-reflected-c", w.recorded_reflected_c, reflected_c_range}});
}

/// What the library finds wrong with a request, of the option that asks instead of the library's
/// key: "measure.count" stands in no help.
Error as_asked(Error error, const std::string& option) {
  constexpr std::string_view table = "measure.";
  if (option == "--request" || !error.where.starts_with(table)) return error;
  error =
      as_typed(std::move(error), {{"measure.apart", "--apart"}, {"measure.profile", "--profile"}});
  if (!error.where.starts_with(table)) return error;
  std::string field = error.where.substr(error.where.rfind('.') + 1);
  // Of one number, or words that name it already.
  const bool clear = field == "count" || option.ends_with(field);
  if (!clear) error.found = field + " " + error.found;
  error.where = option;
  return error;
}

/// The option that asks, of those that were given.
Result<std::string> asked(const MeasureWords& words) {
  const std::pair<const char*, bool> options[] = {{"--pixel", !words.pixel.empty()},
                                                  {"--point", !words.point.empty()},
                                                  {"--box", !words.box.empty()},
                                                  {"--line", !words.line.empty()},
                                                  {"--polygon", !words.polygon.empty()},
                                                  {"--hottest", words.hottest.has_value()},
                                                  {"--coldest", words.coldest.has_value()},
                                                  {"--difference", !words.difference.empty()},
                                                  {"--distance", !words.distance.empty()},
                                                  {"--request", !words.request.empty()}};
  std::string found;
  for (const auto& [option, given] : options) {
    if (!given) continue;
    if (!found.empty())
      return fail(ErrorKind::usage, option, "together with " + found, "ask for one at a time");
    found = option;
  }
  return found;
}

Result<Request> read(const MeasureWords& words, const std::string& option,
                     const ThermalScene& scene, const Measurements& saved) {
  Request request;
  if (option == "--box") return box_of(words.box);
  if (option == "--polygon") return polygon_of(words.polygon);
  if (option == "--request") return json_request(words.request);
  if (option == "--pixel") {
    ORBITFUSE_ASSIGN(Place place, pixel_of(option, words.pixel));
    request.places = {std::move(place)};
  } else if (option == "--point") {
    ORBITFUSE_ASSIGN(Place place, point_of(option, words.point));
    request.places = {std::move(place)};
  } else if (option == "--line" || option == "--distance") {
    request.kind = option == "--line" ? Kind::line : Kind::distance;
    ORBITFUSE_ASSIGN(
        request.places,
        two_places(option, option == "--line" ? words.line : words.distance, scene, saved));
  } else if (option == "--difference") {
    request.kind = Kind::difference;
    for (const std::string& word : words.difference) {
      ORBITFUSE_ASSIGN(Request part, spot_or_saved(option, word, scene, saved));
      request.of.push_back(std::move(part));
    }
  } else {
    request.kind = words.hottest ? Kind::hottest : Kind::coldest;
    request.count = words.hottest ? *words.hottest : *words.coldest;
    request.apart = words.apart.value_or(request.apart);
  }
  request.profile = words.profile.value_or(request.profile);
  return request;
}

}  // namespace

bool names_new_view(const std::string& word) {
  return word.size() > 1 && word[0] == '0' &&
         word.find_first_not_of("0123456789") == std::string::npos;
}

void add_measure_options(CLI::App& app, MeasureWords& w) {
  constexpr const char* kinds = "What to measure";
  const auto place = [&](const char* name, std::string& word, const char* form, const char* text) {
    app.add_option(name, word, text)->type_name(form)->group(kinds);
  };
  const auto two = [&](const char* name, std::vector<std::string>& list, const char* text) {
    app.add_option(name, list, text)->expected(2)->type_name("PLACE PLACE")->group(kinds);
  };
  place("--pixel", w.pixel, "VIEW,U,V", "What a pixel of a rendered or recorded view shows");
  place("--point", w.point, "X,Y,Z", "A point of the run's world");
  place("--box", w.box, "CX,CY,CZ,SX,SY,SZ[,QW,QX,QY,QZ]", "The surface in a box, turned or not");
  two("--line", w.line, "A profile; PLACE is VIEW,U,V or X,Y,Z or a saved spot's name");
  place("--polygon", w.polygon, "VIEW,U,V,U,V,U,V...", "The surface within a polygon in a view");
  app.add_option("--hottest", w.hottest, "Hottest places of the object")
      ->type_name("N")
      ->group(kinds);
  app.add_option("--coldest", w.coldest, "Coldest places of the object")
      ->type_name("N")
      ->group(kinds);
  two("--difference", w.difference, "The first less the second: places or saved measurements");
  two("--distance", w.distance, "Between two places, in the run's unit");
  place("--request", w.request, "JSON", "Any of these as JSON (docs/formats.md)");
  app.add_option("--apart", w.apart,
                 "Least distance between hottest or coldest, run's unit; 0: auto")
      ->default_str("0")
      ->group(kinds);
  app.add_option("--profile", w.profile, "Points along a line")
      ->default_str(std::to_string(Request{}.profile))
      ->group(kinds);

  constexpr const char* radiometry = "Radiometry (after capture; originals stay as they are)";
  app.add_option("--emissivity", w.emissivity, "Of the surface")->group(radiometry);
  app.add_option("--reflected-c", w.reflected_c, "Reflected temperature")->group(radiometry);
  app.add_option("--distance-m", w.distance_m, "Camera to object")->group(radiometry);
  app.add_option("--air-c", w.air_c, "Air temperature")->group(radiometry);
  app.add_option("--humidity", w.humidity_percent, "Relative humidity in percent")
      ->group(radiometry);
  app.add_option("--recorded-emissivity", w.recorded_emissivity,
                 "What the camera was set to, where the session doesn't say")
      ->group(radiometry);
  app.add_option("--recorded-reflected-c", w.recorded_reflected_c, "Likewise")->group(radiometry);

  app.add_option("--name", w.name, "What the measurement is called");
  constexpr const char* report = "With --save, for the inspection report";
  app.add_option("--remark", w.remark, "What was noticed")->group(report);
  app.add_option("--component", w.component, "What the place is part of")->group(report);
  app.add_option("--reference", w.reference, "Name of the saved measurement to compare with")
      ->group(report);
  app.add_flag("--save", w.save, "Keep it in measurements.json of the run");
  app.add_flag("--csv", w.csv, "CSV on stdout");
}

Status check_pairs(const MeasureWords& w) {
  ORBITFUSE_ASSIGN(const std::string question, asked(w));
  constexpr const char* any = "a measurement such as --point";
  const bool asks = !question.empty(), distance = question == "--distance";
  const std::pair<const char*, bool> radiometry[] = {
      {"--emissivity", w.emissivity.has_value()},
      {"--reflected-c", w.reflected_c.has_value()},
      {"--distance-m", w.distance_m.has_value()},
      {"--air-c", w.air_c.has_value()},
      {"--humidity", w.humidity_percent.has_value()},
      {"--recorded-emissivity", w.recorded_emissivity.has_value()},
      {"--recorded-reflected-c", w.recorded_reflected_c.has_value()}};
  for (const auto& [option, given] : radiometry) {
    ORBITFUSE_TRY(check_needs({{option, given, any, asks}}));
    ORBITFUSE_TRY(check_apart({{option, given, "--distance", distance}}));
  }
  return check_needs({{"--apart", w.apart.has_value(), "--hottest or --coldest",
                       w.hottest.has_value() || w.coldest.has_value()},
                      {"--profile", w.profile.has_value(), "--line", !w.line.empty()},
                      {"--name", !w.name.empty(), any, asks},
                      {"--save", w.save, any, asks},
                      {"--remark", !w.remark.empty(), "--save", w.save},
                      {"--component", !w.component.empty(), "--save", w.save},
                      {"--reference", !w.reference.empty(), "--save", w.save}});
}

Result<std::optional<Request>> request_of(const MeasureWords& words, const ThermalScene& scene,
                                          const Measurements& saved) {
  ORBITFUSE_ASSIGN(const std::string option, asked(words));
  if (option.empty()) return std::nullopt;
  ORBITFUSE_ASSIGN(Request request, read(words, option, scene, saved));
  if (!words.name.empty()) request.name = words.name;
  ORBITFUSE_TRY(check_ranges(words));
  add_parameters(words, request);
  ORBITFUSE_TRY(request.validate().map_error(
      [&](Error error) { return as_asked(std::move(error), option); }));
  return request;
}

}  // namespace orbitfuse::cli
