// SPDX-License-Identifier: BSD-3-Clause
#include "app/pipeline/out_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temp_folder.hpp"

namespace orbitfuse::pipeline {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

class OutFolder : public testing::Test {
 protected:
  OutFolder() {
    test::put(temp / "file", "x");
    fs::create_symlink(temp / "nowhere", temp / "broken");
  }
  static void expect_refused(const Status& status, ErrorKind kind, const std::string& words) {
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().kind, kind);
    EXPECT_THAT(status.error().message(), HasSubstr(words));
  }
  const test::TempFolder temp;
};

TEST_F(OutFolder, WhatCanBeAFolderLeavesNothingBehind) {
  for (const char* name : {"", "new", "new/", "a/b/../c/"})
    EXPECT_TRUE(check_out_folder(temp / name)) << name;
  EXPECT_TRUE(check_out_file(temp / "a/b.png"));
  EXPECT_TRUE(check_out_file(temp / "file")) << "files are written over";
  EXPECT_EQ(std::distance(fs::directory_iterator(temp.path()), {}), 2);
}

TEST_F(OutFolder, WhatCannotIsNamed) {
  expect_refused(check_out_folder(temp / "file"), ErrorKind::input, "is no folder");
  expect_refused(check_out_folder(temp / "file/below"), ErrorKind::input, "on its way");
  expect_refused(check_out_folder(temp / "broken"), ErrorKind::input, "a broken link");
  expect_refused(check_out_folder(temp / "broken/below"), ErrorKind::input, "a broken link");
  expect_refused(check_out_folder(temp / std::string(300, 'n')), ErrorKind::usage, "shorter name");
  expect_refused(check_out_folder("/proc/orbitfuse"), ErrorKind::device, "/proc/orbitfuse");
  expect_refused(check_out_file(temp.path()), ErrorKind::input, "is a folder");
  expect_refused(check_out_file(temp / "file/x.png"), ErrorKind::input, "no folder");
}

}  // namespace
}  // namespace orbitfuse::pipeline
