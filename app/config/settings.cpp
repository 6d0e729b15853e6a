// SPDX-License-Identifier: BSD-3-Clause
#include "app/config/settings.hpp"

#define TOML_EXCEPTIONS 1
#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <sstream>

#include "core/near_word.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::config {
namespace {
using nlohmann::json;

json json_of(const toml::node& node) {
  if (const auto* v = node.as_boolean()) return v->get();
  if (const auto* v = node.as_integer()) return v->get();
  if (const auto* v = node.as_floating_point()) return v->get();
  if (const auto* v = node.as_string()) return v->get();
  if (const auto* list = node.as_array()) {
    json j = json::array();
    for (const toml::node& item : *list) j.push_back(json_of(item));
    return j;
  }
  return {};
}

struct Entry {
  std::string key;
  json value;
  unsigned line = 0;
  std::string written;  ///< as TOML: dates and NaN are no JSON
};

std::string written_as(const toml::node& node) {
  if (node.is_table()) return "a table";
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return text.str();
}

/// Tables are walked through, but not those where a value is expected, nor the empty ones, whose
/// names nothing else would look at.
void flatten(const toml::table& table, const std::string& prefix,
             const std::vector<Setting>& settings, std::vector<Entry>& entries) {
  for (const auto& [key, node] : table) {
    const std::string path = prefix + std::string(key.str());
    const bool is_value = std::any_of(settings.begin(), settings.end(),
                                      [&](const Setting& s) { return s.key == path; });
    const toml::table* inner = node.as_table();
    if (inner && !inner->empty() && !is_value)
      flatten(*inner, path + ".", settings, entries);
    else
      entries.push_back(
          {path, json_of(node), static_cast<unsigned>(node.source().begin.line), written_as(node)});
  }
}

/// The first setting of a table; null where no table has that name.
const Setting* first_of(const std::string& table, const std::vector<Setting>& settings) {
  const auto first = std::find_if(settings.begin(), settings.end(),
                                  [&](const Setting& s) { return s.key.starts_with(table + "."); });
  return first == settings.end() ? nullptr : &*first;
}

/// "integer" is what a reference lists; a sentence has an article.
std::string wanted(const Setting& setting, const json& value) {
  if (setting.type == "integer")
    return value.is_number_integer() ? "an integer nearer to 0" : "an integer";
  if (setting.type.starts_with("number")) return "a " + setting.type;
  if (setting.type == "list") return "a list of texts, e.g. [\"heat\", \"best\"]";
  return setting.type;
}

std::string toml_text(const json& value) {
  std::string text = value.dump();
  const bool whole = value.is_number_float() && text.find_first_of(".eE") == std::string::npos;
  return whole ? text + ".0" : text;
}

/// The value of a dotted key, nullptr where there is none; an error where a table on the way is
/// none.
Result<const json*> value_at(const json& values, const std::string& key, const std::string& where) {
  const json* node = &values;
  for (std::size_t begin = 0, end = 0; end != std::string::npos; begin = end + 1) {
    if (!node->is_object())
      return fail(ErrorKind::usage, where,
                  fmt::format("{} = {}", key.substr(0, begin - 1), node->dump()),
                  "it must be a table of settings");
    end = key.find('.', begin);
    const auto next = node->find(key.substr(begin, end - begin));
    if (next == node->end()) return nullptr;
    node = &*next;
  }
  return node;
}

}  // namespace

bool is_utf8(const std::string& text) {
  return json::parse(json(text).dump(-1, ' ', false, json::error_handler_t::replace)) == text;
}

std::string nearest(const std::string& word, const std::vector<std::string>& known) {
  std::string best;
  std::size_t best_edits = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : known) {
    // A key given without its table is a slip too: "budget_s" for "train.visible.budget_s".
    const bool tail = candidate.size() > word.size() && candidate.ends_with("." + word);
    const std::size_t distance = tail ? 1 : edit_distance(word, candidate);
    if (distance < best_edits) {
      best_edits = distance;
      best = candidate;
    }
  }
  return best;
}

Status Settings::set(const std::string& key, const json& value, const std::string& where) {
  const auto it =
      std::find_if(list_.begin(), list_.end(), [&](const Setting& s) { return s.key == key; });
  if (const Setting* inner = first_of(key, list_); it == list_.end() && inner != nullptr)
    return fail(
        ErrorKind::usage, where, fmt::format("{} = {}", key, value.dump()),
        fmt::format("{} is a table of settings: give one of them, e.g. {}", key, inner->key));
  if (it == list_.end()) {
    std::vector<std::string> known;
    for (const Setting& s : list_) known.push_back(s.key);
    const std::string guess = nearest(key, known);
    return fail(
        ErrorKind::usage, where, "unknown key '" + key + "'",
        guess.empty() ? "config/orbitfuse.toml lists every key" : "did you mean '" + guess + "'?");
  }
  // An integer beyond the field's range wraps.
  if (!it->set(value) || (it->type == "integer" && it->get() != value))
    return fail(ErrorKind::usage, where, fmt::format("{} = {}", key, value.dump()),
                "it must be " + wanted(*it, value));
  return {};
}

Status Settings::read_toml(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const std::string text, read_toml_text(file));
  std::vector<Entry> entries;
  try {
    const toml::table table = toml::parse(text, file.string());
    flatten(table, "", list_, entries);
  } catch (const toml::parse_error& e) {
    return fail(ErrorKind::usage, fmt::format("{}:{}", file.string(), e.source().begin.line),
                std::string(e.description()),
                "write it as TOML; config/orbitfuse.toml is an example");
  }
  // A preset sets many fields, which the other keys then change.
  std::stable_partition(entries.begin(), entries.end(),
                        [](const Entry& e) { return e.key.ends_with(".preset"); });
  for (const Entry& e : entries) {
    if (e.value.is_null() && e.written == "a table" && first_of(e.key, list_) != nullptr)
      continue;  // empty
    const std::string where = fmt::format("{}:{}", file.string(), e.line);
    ORBITFUSE_TRY(set(e.key, e.value, where).map_error([&](Error error) {
      if (error.found.starts_with(e.key + " = ")) error.found = e.key + " = " + e.written;
      return error;
    }));
    given_.insert(e.key);
  }
  return {};
}

Status Settings::read_json(const json& values, const std::string& where) {
  for (const bool presets :
       {true, false})  // a preset sets many fields, which the other keys then change
    for (const Setting& s : list_) {
      if (s.key.ends_with(".preset") != presets) continue;
      ORBITFUSE_ASSIGN(const json* value, value_at(values, s.key, where));
      if (value) ORBITFUSE_TRY(set(s.key, *value, where));
    }
  return {};
}

Status Settings::apply(const std::string& assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos)
    return fail(ErrorKind::usage, "--set " + assignment, "no '='", "write --set key=value");
  const std::string key = assignment.substr(0, equals), text = assignment.substr(equals + 1);
  const std::string where = "--set " + assignment;
  if (!is_utf8(assignment))
    return fail(ErrorKind::usage, where, "it is not UTF-8", "write it as UTF-8");
  json value = parse_json(text);
  if (value.is_discarded()) value = text;
  ORBITFUSE_TRY(set(key, value, where));
  given_.insert(key);
  return {};
}

json Settings::to_json(const std::string& prefix) const {
  json result = json::object();
  for (const Setting& s : list_) {
    if (!prefix.empty() && !s.key.starts_with(prefix + ".")) continue;
    std::string path = "/" + (prefix.empty() ? s.key : s.key.substr(prefix.size() + 1));
    std::replace(path.begin(), path.end(), '.', '/');
    result[json::json_pointer(path)] = s.get();
  }
  return result;
}

std::string Settings::to_toml() const {
  std::vector<std::pair<std::string, std::string>> tables;  // TOML wants each table once
  for (const Setting& s : list_) {
    if (s.listed && !s.listed()) continue;
    const std::size_t dot = s.key.rfind('.');
    const std::string table = dot == std::string::npos ? "" : s.key.substr(0, dot);
    auto it = std::find_if(tables.begin(), tables.end(),
                           [&](const auto& entry) { return entry.first == table; });
    if (it == tables.end()) it = tables.insert(tables.end(), {table, ""});
    it->second += fmt::format("# {} ({})\n{} = {}\n", s.doc, s.type,
                              s.key.substr(table.empty() ? 0 : dot + 1), toml_text(s.get()));
  }
  std::string text;
  for (const auto& [table, lines] : tables) text += fmt::format("\n[{}]\n{}", table, lines);
  return text;
}

}  // namespace orbitfuse::config
