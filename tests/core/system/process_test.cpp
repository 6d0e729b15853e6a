// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/process.hpp"

#include <gtest/gtest.h>

#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

TEST(Process, ExitStatusAndOutput) {
  const test::TempFolder folder;
  const auto log = folder / "log";
  const auto good = run_process({"/bin/sh", "-c", "echo out; echo err >&2"}, log, "t", {});
  ASSERT_TRUE(good);
  EXPECT_EQ(*good, 0);
  const auto bad = run_process({"/bin/sh", "-c", "exit 3"}, log, "t", {});
  ASSERT_TRUE(bad);
  EXPECT_EQ(*bad, 3);
  EXPECT_NE(test::get(log).find("out"), std::string::npos);
  EXPECT_NE(test::get(log).find("err"), std::string::npos);
}

TEST(Process, ArgumentsAreNotReadByAShell) {
  const test::TempFolder folder;
  const auto log = folder / "log";
  ASSERT_TRUE(run_process({"/bin/echo", "$HOME; `id` \"quoted\""}, log, "t", {}));
  EXPECT_NE(test::get(log).find("$HOME; `id` \"quoted\""), std::string::npos);
}

TEST(Process, MissingProgramIsUnavailable) {
  const test::TempFolder folder;
  const auto result = run_process({"no-such-program-here"}, folder / "log", "t", {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::unavailable);
  EXPECT_NE(result.error().message().find("no-such-program-here"), std::string::npos);
}

TEST(Process, KilledBySignal) {
  const test::TempFolder folder;
  const auto result = run_process({"/bin/sh", "-c", "kill -9 $$"}, folder / "log", "t", {});
  ASSERT_TRUE(result);
  EXPECT_EQ(*result, 128 + 9);
}

}  // namespace
}  // namespace orbitfuse
