// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace orbitfuse {

enum class TemperatureUnit { kelvin, celsius, other };

/// The unit that JSON text (an ImageDescription, a sidecar) names for its samples: "kelvin", "K",
/// "degC", "degrees Celsius" ...; other: Fahrenheit and fractions of a kelvin. Nothing where it
/// names none, or one of something else than temperatures.
std::optional<TemperatureUnit> temperature_unit_of(std::string_view text);

/// Whether such text says that samples of 0 are none ("invalid": 0).
bool says_zero_is_none(std::string_view text);
/// Input error where it says so of another number: such samples would be temperatures.
Status check_invalid(std::string_view text, const std::string& where);

}  // namespace orbitfuse
