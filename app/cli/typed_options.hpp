// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <initializer_list>
#include <optional>
#include <string>

#include "core/option_range.hpp"
#include "core/result.hpp"

namespace orbitfuse::cli {

/// A number as it was typed. A library's own check would name its key and unit, which the user
/// never wrote: 9 where 900 was typed.
struct TypedNumber {
  const char* option;
  std::optional<double> value;  ///< none: not given
  OptionRange range;            ///< in the unit of the command line
};

/// Usage error for the first number that lies outside of its range.
inline Status check_typed(std::initializer_list<TypedNumber> numbers) {
  for (const auto& [option, value, range] : numbers) {
    if (!value || range.contains(*value)) continue;
    return fail(ErrorKind::usage, option, fmt::format("{}", *value), "choose " + range.words());
  }
  return {};
}

/// What the options of radiometry may be, in degrees Celsius, metres and percent.
inline constexpr OptionRange emissivity_range = from_to(0.01, 1);
inline constexpr OptionRange reflected_c_range = from_to(-272, 4700);
inline constexpr OptionRange distance_m_range = from_to(0, 1e5);
inline constexpr OptionRange air_c_range = from_to(-120, 120);
/// No open air is as dry as 1 %: 0.5 is a half.
inline constexpr OptionRange humidity_percent_range = from_to(1, 100);

/// A key of the library, and the option that sets it.
struct TypedKey {
  const char* key;
  const char* option;
};

/// The error with the option in the place of the key.
inline Error as_typed(Error error, std::initializer_list<TypedKey> keys) {
  for (const auto& [key, option] : keys)
    if (error.where == key) error.where = option;
  return error;
}

/// Of the page that a verb serves (core/http/page_options.hpp).
inline Error as_typed_page(Error error) {
  return as_typed(std::move(error), {{"page.port", "--page"}, {"page.token", "--token"}});
}

}  // namespace orbitfuse::cli
