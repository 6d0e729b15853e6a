// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"

// JSON and TOML from outside. What copies, prints or destroys a nested value goes down on the stack
// level by level: a file of 200,000 brackets would end the program.
namespace orbitfuse {

inline constexpr int max_nesting = 100;  ///< far more than any format here has

/// Whether lists and objects of JSON text nest deeper than that. Looks at brackets only.
bool nests_too_deep(std::string_view json);

/// A key that an object has a second time, and the line of that one (from 1).
struct RepeatedKey {
  std::string key;
  int line = 0;
};
/// The first such of JSON text: which of the two values is meant nobody knows. Objects that a cut
/// leaves open are passed over.
std::optional<RepeatedKey> repeated_key(std::string_view json);

/// Discarded where the text is not JSON, nests too deep or has a key twice in one object.
nlohmann::json parse_json(std::string_view text);

/// What keeps text from being read so, and where in it: Python, for one, writes NaN.
std::string json_fault(std::string_view text);

/// The text of a TOML file of bounded size, for toml::parse, which bounds brackets itself but not
/// the parts of a dotted key. Input error naming the file and line.
Result<std::string> read_toml_text(const std::filesystem::path& file);

}  // namespace orbitfuse
