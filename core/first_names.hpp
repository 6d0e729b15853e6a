// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

namespace orbitfuse {

/// The first names of a list that may be long: "a, b, c and 4 more"; empty of none.
inline std::string first_names(const std::vector<std::string>& names, std::size_t most) {
  const std::size_t named = std::min(names.size(), most);
  const auto end = names.begin() + static_cast<std::ptrdiff_t>(named);
  return fmt::format("{}{}", fmt::join(names.begin(), end, ", "),
                     names.size() > named ? fmt::format(" and {} more", names.size() - named) : "");
}

}  // namespace orbitfuse
