// SPDX-License-Identifier: BSD-3-Clause
#include "core/progress.hpp"

#include <gtest/gtest.h>

namespace orbitfuse {
namespace {

TEST(Progress, WhatIsStoppedAdvisesNoResumeOfItsOwn) {
  std::atomic<bool> cancel = false;
  const Progress progress{.cancel = &cancel};
  EXPECT_TRUE(progress.check("depth"));
  cancel = true;
  const Status stopped = progress.check("depth");
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::cancelled);
  // Only a stage of a run keeps half-done work: the runner says so.
  EXPECT_EQ(stopped.error().message().find("--resume"), std::string::npos);
  EXPECT_TRUE(Progress{}.check("depth")) << "nobody can stop it";
}

}  // namespace
}  // namespace orbitfuse
