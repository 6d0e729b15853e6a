// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/app/cli/program.hpp"

namespace orbitfuse {

using Runner = std::function<Outcome(const std::vector<std::string>&)>;

inline std::string error_line(const Outcome& outcome) {
  const std::size_t at = outcome.err.find("error: ");
  return at == std::string::npos ? "" : outcome.err.substr(at);
}

/// Refused with this code and these words, and --dry-run says the same.
inline void expect_refused(
    std::vector<std::string> arguments, int code, const std::string& words,
    const Runner& run = [](const auto& a) { return orbitfuse_program(a); }) {
  const Outcome real = run(arguments);
  arguments.emplace_back("--dry-run");
  const Outcome dry = run(arguments);
  EXPECT_EQ(real.code, code) << real.err;
  EXPECT_THAT(error_line(real), ::testing::HasSubstr(words));
  EXPECT_EQ(dry.code, code) << dry.err;
  EXPECT_EQ(error_line(dry), error_line(real));
}

}  // namespace orbitfuse
