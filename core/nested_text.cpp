// SPDX-License-Identifier: BSD-3-Clause
#include "core/nested_text.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

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

nlohmann::json parse_json(std::string_view text) {
  if (nests_too_deep(text)) return nlohmann::json(nlohmann::json::value_t::discarded);
  return nlohmann::json::parse(text, nullptr, false);
}

std::string json_fault(std::string_view text) {
  if (nests_too_deep(text))
    return fmt::format("lists within lists, more than {} deep", max_nesting);
  try {
    if (!nlohmann::json::parse(text).is_discarded()) return {};
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
