// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse::config {

/// One key of the configuration, bound to a field of an options struct.
struct Setting {
  std::string key;   ///< e.g. "train.visible.budget_s"
  std::string doc;   ///< one line; becomes the comment in the TOML reference
  std::string type;  ///< "integer", "number", "true or false", "text", or the allowed words
  std::function<nlohmann::json()> get;
  std::function<bool(const nlohmann::json&)> set;  ///< false: not of the type
  /// Whether to_toml() has it; absent: always. A preset's fields are there where they differ from
  /// it.
  std::function<bool()> listed = {};
};

/// The configuration as a list of keys: read from TOML, overridden by --set, written into every
/// stage.json, printed as the reference. The fields live in the modules' own option structs.
class Settings {
 public:
  template <class T>
  void add(std::string key, T& field, std::string doc) {
    list_.push_back({std::move(key), std::move(doc), type_name<T>(),
                     [&field] { return value_of(field); },
                     [&field](const nlohmann::json& j) { return assign(field, j); }});
  }
  /// An enum, written as one of `words` (value, word).
  template <class E>
  void add_choice(std::string key, E& field, std::vector<std::pair<E, std::string>> words,
                  std::string doc);

  void add(Setting setting) { list_.push_back(std::move(setting)); }

  const std::vector<Setting>& list() const { return list_; }
  /// Keys that read_toml() and apply() have set: the user's own words.
  const std::set<std::string>& given() const { return given_; }

  /// Usage error naming file, line and key; an unknown key with the nearest known one.
  Status read_toml(const std::filesystem::path& file);
  /// What to_json() wrote; keys of other versions are passed over.
  Status read_json(const nlohmann::json& values, const std::string& where);
  /// "key=value" with the value as in TOML (quotes may be left out).
  Status apply(const std::string& assignment);

  /// Nested values; with a prefix ("train.visible"), only those below it.
  nlohmann::json to_json(const std::string& prefix = "") const;
  /// Every key with its comment and present value.
  std::string to_toml() const;

 private:
  Status set(const std::string& key, const nlohmann::json& value, const std::string& where);

  template <class T>
  static std::string type_name() {
    if constexpr (std::is_same_v<T, bool>)
      return "true or false";
    else if constexpr (std::is_integral_v<T>)
      return "integer";
    else if constexpr (std::is_floating_point_v<T>)
      return "number";
    else if constexpr (std::is_same_v<T, std::string>)
      return "text";
    else if constexpr (std::is_same_v<T, std::optional<double>>)
      return "number or \"auto\"";
    else
      return "list";
  }
  template <class T>
  static nlohmann::json value_of(const T& field) {
    // 0.1f must read 0.1, not 0.10000000149.
    if constexpr (std::is_same_v<T, float>)
      return std::stod(fmt::format("{}", field));
    else if constexpr (std::is_same_v<T, std::optional<double>>)
      return field ? nlohmann::json(*field) : nlohmann::json("auto");
    else
      return field;
  }
  template <class T>
  static bool assign(T& field, const nlohmann::json& j) {
    if constexpr (std::is_same_v<T, std::optional<double>>) {
      if (j != "auto" && !j.is_number()) return false;
      field = j.is_number() ? std::optional(j.get<double>()) : std::nullopt;
      return true;
    } else {
      return assign_plain(field, j);
    }
  }
  template <class T>
  static bool assign_plain(T& field, const nlohmann::json& j) {
    if constexpr (std::is_same_v<T, bool>) {
      if (!j.is_boolean()) return false;
    } else if constexpr (std::is_integral_v<T>) {
      if (!j.is_number_integer()) return false;
    } else if constexpr (std::is_floating_point_v<T>) {
      if (!j.is_number()) return false;
    } else if constexpr (std::is_same_v<T, std::string>) {
      if (!j.is_string()) return false;
    } else if (!j.is_array())
      return false;
    try {
      field = j.get<T>();
    } catch (const nlohmann::json::exception&) {
      return false;
    }
    return true;
  }

  std::vector<Setting> list_;
  std::set<std::string> given_;
};

template <class E>
void Settings::add_choice(std::string key, E& field, std::vector<std::pair<E, std::string>> words,
                          std::string doc) {
  std::string type = "one of";
  for (const auto& [value, word] : words) type += " " + word;
  list_.push_back({std::move(key), std::move(doc), std::move(type),
                   [&field, words] {
                     for (const auto& [value, word] : words)
                       if (value == field) return nlohmann::json(word);
                     return nlohmann::json();
                   },
                   [&field, words](const nlohmann::json& j) {
                     for (const auto& [value, word] : words)
                       if (j == word) {
                         field = value;
                         return true;
                       }
                     return false;
                   }});
}

/// JSON, and so every record of a run, holds nothing else.
bool is_utf8(const std::string& text);

/// The known word that takes the fewest edits from `word`, when that is few enough to be a slip.
std::string nearest(const std::string& word, const std::vector<std::string>& known);

}  // namespace orbitfuse::config
