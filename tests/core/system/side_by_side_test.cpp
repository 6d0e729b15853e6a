// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/side_by_side.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <string>

namespace orbitfuse {
namespace {

TEST(SideBySide, RunsAllAndGivesTheFirstErrorInTheirOrder) {
  std::atomic<int> run = 0;
  std::vector<std::function<Status()>> tasks;
  for (int i = 0; i < 20; ++i)
    tasks.emplace_back([&run, i]() -> Status {
      ++run;
      if (i % 7 != 6) return {};
      return fail(ErrorKind::input, std::to_string(i), "made to fail", "nothing");
    });
  const Status status = side_by_side(tasks);
  EXPECT_EQ(run, 20);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().where, "6");
  EXPECT_TRUE(side_by_side({}));
}

}  // namespace
}  // namespace orbitfuse
