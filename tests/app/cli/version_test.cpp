// SPDX-License-Identifier: BSD-3-Clause
// The version is written once, in CMakeLists.txt; what else names it agrees.
#include <gtest/gtest.h>

#include <regex>

#include "app/pipeline/runner.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

TEST(Version, TheChangelogBeginsWithIt) {
  const auto changes = read_file(ORBITFUSE_SOURCE_DIR "/CHANGELOG.md");
  ASSERT_TRUE(changes);
  std::smatch heading;
  ASSERT_TRUE(std::regex_search(*changes, heading, std::regex("## ([0-9.]+) - [0-9]{4}-[0-9]{2}-[0-9]{2}")));
  EXPECT_EQ(heading[1], pipeline::software_version());
}

}  // namespace
}  // namespace orbitfuse
