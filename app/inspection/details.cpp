// SPDX-License-Identifier: BSD-3-Clause
#include "app/inspection/details.hpp"

#define TOML_EXCEPTIONS 1
#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>

#include "app/config/settings.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::embedded {
extern const std::string_view inspection_template;
}

namespace orbitfuse::inspection {
namespace {

const std::vector<std::string>& text_keys() {
  static const std::vector<std::string> keys = {"inspection.title",
                                                "inspection.number",
                                                "inspection.object",
                                                "inspection.place",
                                                "inspection.client",
                                                "inspection.purpose",
                                                "inspection.standard",
                                                "inspection.operator",
                                                "inspection.qualification",
                                                "inspection.weather",
                                                "inspection.remarks",
                                                "cameras.thermal",
                                                "cameras.thermal_serial",
                                                "cameras.thermal_calibrated",
                                                "cameras.visible",
                                                "cameras.visible_serial",
                                                "cameras.thermal_time",
                                                "cameras.visible_time",
                                                "conditions.operating_state",
                                                "conditions.construction",
                                                "conditions.orientation",
                                                "conditions.outdoor_air",
                                                "conditions.indoor_air",
                                                "conditions.pressure_difference",
                                                "conditions.sun",
                                                "conditions.precipitation",
                                                "conditions.wind",
                                                "radiometry.emissivity_from"};
  return keys;
}

/// Like components under like load; assets/template.toml says the same.
std::vector<PriorityClass> default_classes() {
  return {{15, true, "1", "repair at once"},
          {3, true, "2", "repair when the object can next be stopped"},
          {1, false, "3", "watch, and look for the cause"}};
}

/// Reads one file's tables; errors name its lines.
class Reading {
 public:
  Reading(std::string file, InspectionDetails& details)
      : file_(std::move(file)), details_(details) {}

  Status all(const toml::table& root) {
    for (const auto& [key, node] : root) {
      const std::string name(key.str());
      if (name == "class" || name == "finding") {
        ORBITFUSE_TRY(list(name, node));
      } else if (const toml::table* table = node.as_table()) {
        for (const auto& [inner, value] : *table)
          ORBITFUSE_TRY(entry(name + "." + std::string(inner.str()), value));
      } else {
        return unknown(name, node, all_keys());
      }
    }
    if (details_.classes.empty()) details_.classes = default_classes();
    std::stable_sort(
        details_.classes.begin(), details_.classes.end(),
        [](const PriorityClass& a, const PriorityClass& b) { return a.from_k > b.from_k; });
    for (std::size_t i = 1; i < details_.classes.size(); ++i)
      if (details_.classes[i].from_k == details_.classes[i - 1].from_k)
        return fail(ErrorKind::usage, file_,
                    fmt::format("two classes from {:g} K", details_.classes[i].from_k),
                    "give each [[class]] a difference of its own");
    return {};
  }

 private:
  std::string at(const toml::node& node) const {
    return fmt::format("{}:{}", file_, node.source().begin.line);
  }
  tl::unexpected<Error> wrong(const std::string& key, const toml::node& node,
                              const std::string& wanted) const {
    return fail(ErrorKind::usage, at(node), key, "it must be " + wanted);
  }
  tl::unexpected<Error> incomplete(const toml::table& table, const char* what,
                                   const char* remedy) const {
    return fail(ErrorKind::usage, at(table),
                fmt::format("a [[{}]] that lacks or doubles a key", what), remedy);
  }
  tl::unexpected<Error> unknown(const std::string& key, const toml::node& node,
                                const std::vector<std::string>& known) const {
    const std::string guess = config::nearest(key, known);
    return fail(ErrorKind::usage, at(node), "unknown key '" + key + "'",
                guess.empty() ? "orbitfuse report --print-template lists every key"
                              : "did you mean '" + guess + "'?");
  }
  std::vector<std::string> all_keys() const {
    std::vector<std::string> keys = text_keys();
    for (const char* key : {"radiometry.emissivity", "radiometry.reflected_c",
                            "radiometry.distance_m", "radiometry.humidity_percent", "class",
                            "finding", "inspection", "cameras", "conditions", "radiometry"})
      keys.emplace_back(key);
    return keys;
  }

  Result<std::string> text(const std::string& key, const toml::node& node) const {
    if (const auto* value = node.as_string()) return value->get();
    return wrong(key, node, "a text in quotes");
  }
  Result<double> number(const std::string& key, const toml::node& node, double low,
                        double high) const {
    const std::optional<double> value = node.value<double>();
    if (value && node.is_number() && std::isfinite(*value) && *value >= low && *value <= high)
      return *value;
    return wrong(key, node, fmt::format("a number of {:g} to {:g}", low, high));
  }

  Status entry(const std::string& key, const toml::node& node) {
    const auto& texts = text_keys();
    if (std::find(texts.begin(), texts.end(), key) != texts.end()) {
      ORBITFUSE_ASSIGN(details_.texts[key], text(key, node));
      return {};
    }
    struct Limited {
      const char* key;
      std::optional<double>* value;
      double low, high;
    };
    for (const Limited& known :
         {Limited{"radiometry.emissivity", &details_.emissivity, 0.01, 1},
          Limited{"radiometry.reflected_c", &details_.reflected_c, -272, 4000},
          Limited{"radiometry.distance_m", &details_.distance_m, 0, 1e5},
          Limited{"radiometry.humidity_percent", &details_.humidity_percent, 0, 100}})
      if (key == known.key) {
        ORBITFUSE_ASSIGN(*known.value, number(key, node, known.low, known.high));
        return {};
      }
    return unknown(key, node, all_keys());
  }

  Status list(const std::string& name, const toml::node& node) {
    const toml::array* tables = node.as_array();
    if (tables == nullptr) return wrong(name, node, "written as [[" + name + "]]");
    for (const toml::node& item : *tables) {
      const toml::table* table = item.as_table();
      if (table == nullptr) return wrong(name, item, "written as [[" + name + "]]");
      ORBITFUSE_TRY(name == "class" ? priority(*table) : finding(*table));
    }
    return {};
  }

  Status priority(const toml::table& table) {
    PriorityClass one;
    bool has_limit = false;
    for (const auto& [key, node] : table) {
      const std::string name(key.str());
      if (name == "above_k" || name == "from_k") {
        if (has_limit) return incomplete(table, "class", "give it one of above_k and from_k");
        ORBITFUSE_ASSIGN(one.from_k, number(name, node, 0, 10000));
        one.above = name == "above_k";
        has_limit = true;
      } else if (name == "name") {
        ORBITFUSE_ASSIGN(one.name, text(name, node));
      } else if (name == "action") {
        ORBITFUSE_ASSIGN(one.action, text(name, node));
      } else {
        return unknown(name, node, {"above_k", "from_k", "name", "action"});
      }
    }
    if (!has_limit || one.name.empty())
      return incomplete(table, "class", "give it above_k (or from_k) and a name");
    details_.classes.push_back(std::move(one));
    return {};
  }

  Status finding(const toml::table& table) {
    FindingDetails one;
    one.where = at(table);
    const std::pair<const char*, std::string*> texts[] = {
        {"measurement", &one.measurement}, {"title", &one.title},
        {"component", &one.component},     {"reference", &one.reference},
        {"remark", &one.remark},           {"recommendation", &one.recommendation}};
    for (const auto& [key, node] : table) {
      const std::string_view named = key.str();
      const auto* known = std::find_if(std::begin(texts), std::end(texts),
                                       [&](const auto& t) { return named == t.first; });
      if (known == std::end(texts)) {
        std::vector<std::string> names;
        for (const auto& t : texts) names.emplace_back(t.first);
        return unknown(std::string(named), node, names);
      }
      ORBITFUSE_ASSIGN(*known->second, text(known->first, node));
    }
    if (one.measurement.empty())
      return incomplete(table, "finding", "give it measurement, the name of a saved one");
    for (const FindingDetails& other : details_.findings)
      if (other.measurement == one.measurement)
        return fail(ErrorKind::usage, one.where,
                    "a second [[finding]] of measurement '" + one.measurement + "'",
                    "say all of it in one");
    details_.findings.push_back(std::move(one));
    return {};
  }

  std::string file_;
  InspectionDetails& details_;
};

}  // namespace

const std::string& InspectionDetails::text(const std::string& key) const {
  static const std::string none;
  const auto found = texts.find(key);
  return found == texts.end() ? none : found->second;
}

Result<InspectionDetails> parse_details(std::string_view text, const std::string& name) {
  InspectionDetails details;
  try {
    ORBITFUSE_TRY(Reading(name, details).all(toml::parse(text, name)));
  } catch (const toml::parse_error& e) {
    return fail(ErrorKind::usage, fmt::format("{}:{}", name, e.source().begin.line),
                std::string(e.description()),
                "write it as TOML; orbitfuse report --print-template prints one to fill in");
  }
  return details;
}

Result<InspectionDetails> read_details(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const std::string text, read_file(file, max_settings_bytes));
  return parse_details(text, file.string());
}

std::string_view details_template() { return embedded::inspection_template; }

}  // namespace orbitfuse::inspection
