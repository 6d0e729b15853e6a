// SPDX-License-Identifier: BSD-3-Clause
#include "core/option_range.hpp"

#include <fmt/format.h>

#include <cmath>

namespace orbitfuse {

bool OptionRange::contains(double value) const {
  const bool high_enough = low_included ? value >= low : value > low;
  const bool low_enough = high_included ? value <= high : value < high;
  return high_enough && low_enough;
}

std::string OptionRange::words() const {
  if (std::isinf(high) && std::isinf(low)) return "any number";
  if (std::isinf(high))
    return low_included ? fmt::format("{} or more", low) : fmt::format("a number above {}", low);
  if (std::isinf(low))
    return high_included ? fmt::format("{} or less", high) : fmt::format("a number below {}", high);
  if (low_included && high_included) return fmt::format("{} to {}", low, high);
  return fmt::format("{} {}, {} {}", low_included ? "from" : "above", low,
                     high_included ? "up to" : "below", high);
}

Status OptionCheck::operator()(std::string_view field, double value,
                               const OptionRange& range) const {
  if (range.contains(value)) return {};
  return fail(ErrorKind::usage, fmt::format("{}.{}", table_, field), fmt::format("{}", value),
              "choose " + range.words());
}

}  // namespace orbitfuse
