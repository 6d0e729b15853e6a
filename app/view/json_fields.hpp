// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/result.hpp"

// Fields of a request's JSON; usage errors name the field, what was found and what it must be.
namespace orbitfuse::view {

/// A body that is a JSON object.
Result<nlohmann::json> json_body(const std::string& body);

Result<double> number_field(const nlohmann::json& j, const char* field, double low, double high);
/// 1 to `longest` bytes.
Result<std::string> text_field(const nlohmann::json& j, const char* field, std::size_t longest);
/// Exactly `count` numbers, finite and of sensible size.
Result<std::vector<double>> numbers_field(const nlohmann::json& j, const char* field,
                                          std::size_t count);

template <std::size_t N>
Result<std::array<double, N>> number_fields(const nlohmann::json& j, const char* field) {
  ORBITFUSE_ASSIGN(const std::vector<double> list, numbers_field(j, field, N));
  std::array<double, N> values{};
  for (std::size_t i = 0; i < N; ++i) values[i] = list[i];
  return values;
}

/// Of a value in an error: short, and only ASCII.
std::string shown(const nlohmann::json& j);

}  // namespace orbitfuse::view
