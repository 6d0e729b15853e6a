// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string_view>

namespace orbitfuse {

/// Insertions, deletions and substitutions that turn one word into the other (Levenshtein 1966);
/// what "did you mean" is chosen by.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace orbitfuse
