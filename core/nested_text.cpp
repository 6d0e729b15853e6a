// SPDX-License-Identifier: BSD-3-Clause
#include "core/nested_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>
#include <tuple>
#include <vector>

#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

constexpr std::size_t longest_shown = 60;  ///< of a key in an error

/// Where the string that opens at `at` ends: at its closing quote or the end of the line.
std::size_t end_of_string(std::string_view text, std::size_t at) {
  const char quote = text[at];
  for (std::size_t i = at + 1; i < text.size(); ++i) {
    if (text[i] == '\\' && quote == '"')
      ++i;
    else if (text[i] == quote || text[i] == '\n')
      return i;
  }
  return text.size();
}

/// A key as it stands between its quotes.
struct Key {
  std::string_view text;
  std::size_t at = 0;
};

/// What a key is called: it may write "a" as "\u0061".
std::string unescaped(std::string_view text) {
  if (text.find('\\') == text.npos) return std::string(text);
  const auto value = nlohmann::json::parse(fmt::format("\"{}\"", text), nullptr, false);
  return value.is_string() ? value.get<std::string>() : std::string(text);
}

/// The first of one object's keys that was there before; null where there is none. Sorts them.
const Key* first_repeated(std::span<Key> keys, std::vector<std::string>& names) {
  if (std::any_of(keys.begin(), keys.end(),
                  [](const Key& key) { return key.text.find('\\') != key.text.npos; })) {
    names.clear();
    names.reserve(keys.size());  // the keys look into it
    for (Key& key : keys) key.text = names.emplace_back(unescaped(key.text));
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return std::tie(a.text, a.at) < std::tie(b.text, b.at);
  });
  const Key* first = nullptr;
  for (std::size_t i = 1; i < keys.size(); ++i)
    if (keys[i].text == keys[i - 1].text && (!first || keys[i].at < first->at)) first = &keys[i];
  return first;
}

}  // namespace

bool nests_too_deep(std::string_view json) {
  int depth = 0;
  for (std::size_t i = 0; i < json.size(); ++i) {
    if (json[i] == '"') {
      i = end_of_string(json, i);
    } else if (json[i] == '[' || json[i] == '{') {
      if (++depth > max_nesting) return true;
    } else if (json[i] == ']' || json[i] == '}') {
      --depth;
    }
  }
  return false;
}

std::optional<RepeatedKey> repeated_key(std::string_view json) {
  std::vector<Key> keys;              // of all open objects, the innermost's last
  std::vector<std::size_t> first_of;  // of each open object, its first among those
  std::vector<std::string> names;
  for (std::size_t i = 0; i < json.size(); ++i) {
    if (json[i] == '{') {
      first_of.push_back(keys.size());
    } else if (json[i] == '}' && !first_of.empty()) {
      const auto own = std::span(keys).subspan(first_of.back());
      if (const Key* key = first_repeated(own, names)) {
        const auto before = json.substr(0, key->at);
        return RepeatedKey{std::string(key->text.substr(0, longest_shown)),
                           1 + static_cast<int>(std::count(before.begin(), before.end(), '\n'))};
      }
      keys.resize(first_of.back());
      first_of.pop_back();
    } else if (json[i] == '"') {
      const std::size_t at = i;
      i = end_of_string(json, at);
      const std::size_t next = json.find_first_not_of(" \t\r\n", i + 1);
      if (next < json.size() && json[next] == ':' && !first_of.empty())
        keys.push_back({json.substr(at + 1, i - at - 1), at});
    }
  }
  return std::nullopt;
}

nlohmann::json parse_json(std::string_view text) {
  nlohmann::json value(nlohmann::json::value_t::discarded);
  if (nests_too_deep(text)) return value;
  value = nlohmann::json::parse(text, nullptr, false);
  if (value.is_structured() && repeated_key(text)) value = nlohmann::json::value_t::discarded;
  return value;
}

std::string json_fault(std::string_view text) {
  if (nests_too_deep(text))
    return fmt::format("lists within lists, more than {} deep", max_nesting);
  try {
    if (nlohmann::json::parse(text).is_structured())
      if (const auto twice = repeated_key(text))
        return fmt::format("the key \"{}\" twice in one object, the second time in line {}",
                           twice->key, twice->line);
  } catch (const nlohmann::json::exception& error) {
    // "[json.exception.parse_error.101] parse error at line 3, ...": the place, or the number.
    const std::string what = error.what();
    return "not JSON, or cut off: " + what.substr(what.find("] ") + 2);
  }
  return {};
}

Result<std::string> read_toml_text(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(std::string text, read_file(file, max_settings_bytes));
  int line = 1, dots = 0;  // since the last sign that ends a key
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"' || text[i] == '\'') i = end_of_string(text, i);
    if (i < text.size() && text[i] == '#') i = text.find('\n', i);
    if (i >= text.size()) break;
    line += text[i] == '\n';
    if (std::string_view("\n=,[]{}").find(text[i]) != std::string_view::npos) dots = 0;
    if (text[i] == '.' && ++dots > max_nesting) {
      return fail(ErrorKind::input, fmt::format("{}:{}", file.string(), line),
                  fmt::format("a key of more than {} parts", max_nesting),
                  "write it as TOML; config/orbitfuse.toml is an example");
    }
  }
  return text;
}

}  // namespace orbitfuse
