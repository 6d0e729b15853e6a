// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/scratch_folder.hpp"

#include <gtest/gtest.h>

#include <fstream>

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

TEST(ScratchFolder, IsItsOwnersAloneAndGoneAfterwards) {
  fs::path left;
  {
    const auto folder = ScratchFolder::make();
    ASSERT_TRUE(folder);
    left = folder->path();
    EXPECT_EQ(fs::status(left).permissions(), fs::perms::owner_all);
    fs::create_directories(left / "deep" / "er");
    std::ofstream(left / "deep" / "file") << "kept until the end";
  }
  EXPECT_FALSE(fs::exists(left));
}

TEST(ScratchFolder, TwoAreTwo) {
  const auto first = ScratchFolder::make(), second = ScratchFolder::make();
  ASSERT_TRUE(first && second);
  EXPECT_NE(first->path(), second->path());
}

TEST(ScratchFolder, MovedItIsRemovedOnce) {
  auto folder = ScratchFolder::make();
  ASSERT_TRUE(folder);
  const fs::path path = folder->path();
  {
    const ScratchFolder taken = std::move(*folder);
    EXPECT_EQ(taken.path(), path);
    EXPECT_TRUE(fs::exists(path));
  }
  EXPECT_FALSE(fs::exists(path));
  EXPECT_TRUE(folder->path().empty());
}

TEST(ScratchFolder, AParentThatIsNoneIsNamed) {
  const auto folder = ScratchFolder::make("/dev/null/nowhere");
  ASSERT_FALSE(folder);
  EXPECT_EQ(folder.error().kind, ErrorKind::device);
  EXPECT_NE(folder.error().message().find("/dev/null/nowhere"), std::string::npos);
}

}  // namespace
}  // namespace orbitfuse
