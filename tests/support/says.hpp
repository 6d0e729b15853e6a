// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gmock/gmock.h>

namespace orbitfuse::test {

/// Matches a text in which all of these words stand.
template <class... Words>
auto says(const Words&... words) {
  return ::testing::AllOf(::testing::HasSubstr(words)...);
}

/// Matches a text in which they don't stand together.
template <class... Words>
auto says_not(const Words&... words) {
  return ::testing::Not(says(words...));
}

/// Matches texts of which one says all of these words: warnings.
template <class... Words>
auto one_says(const Words&... words) {
  return ::testing::Contains(says(words...));
}

/// Matches texts of which none does.
template <class... Words>
auto none_says(const Words&... words) {
  return ::testing::Not(one_says(words...));
}

}  // namespace orbitfuse::test
