// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace orbitfuse {

/// Where an option's value may lie. NaN lies nowhere; infinity only where nothing bounds it.
struct OptionRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_included = true, high_included = true;

  bool contains(double value) const;
  /// "0 to 1", "above 0, up to 90", "1 or more".
  std::string words() const;
};

constexpr OptionRange from_to(double low, double high) { return {low, high}; }
constexpr OptionRange at_least(double low) { return {.low = low, .high_included = false}; }
constexpr OptionRange above(double low) {
  return {.low = low, .low_included = false, .high_included = false};
}
constexpr OptionRange above_up_to(double low, double high) { return {low, high, false, true}; }
constexpr OptionRange between(double low, double high) { return {low, high, false, false}; }

/// Checks the fields of one table of options: check("points", points, from_to(100, 65000)).
class OptionCheck {
 public:
  explicit OptionCheck(std::string_view table) : table_(table) {}
  /// Usage error "table.field: value; choose RANGE".
  Status operator()(std::string_view field, double value, const OptionRange& range) const;

 private:
  std::string_view table_;
};

}  // namespace orbitfuse
