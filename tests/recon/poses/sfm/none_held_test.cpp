// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/system/file_io.hpp"
#include "recon/poses/sfm/sfm_ladder.hpp"
#include "tests/support/temp_folder.hpp"

// What a user reads when no attempt at posing held: the nearest one, and where the others are.
namespace orbitfuse {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

LadderStep step(const std::string& attempt, int posed, const std::string& why) {
  return {.attempt = attempt, .why = why, .posed = posed, .total = 6};
}

TEST(NoneHeld, NamesTheNearestAttemptAndListsAllInAFile) {
  const test::TempFolder temp;
  const std::vector<LadderStep> steps = {step("one", 0, "no model"), step("two", 4, "4/6 views"),
                                         step("three", 4, "4/6 views, 9 px")};
  const Error error = none_held(steps, Modality::visible, temp.path() / "visible").value();
  EXPECT_EQ(error.kind, ErrorKind::quality);
  EXPECT_THAT(error.found, HasSubstr("none of 3 attempts"));
  EXPECT_THAT(error.found, HasSubstr("the nearest, two: 4/6 views"));
  EXPECT_THAT(error.found, Not(HasSubstr("three")));
  const auto list = read_file(temp.path() / "visible" / attempts_file);
  ASSERT_TRUE(list) << list.error().message();
  EXPECT_EQ(*list, "one: no model\ntwo: 4/6 views\nthree: 4/6 views, 9 px\n");
}

TEST(NoneHeld, OfOneAttemptTheReasonIsTheMessage) {
  const test::TempFolder temp;
  const Error error =
      none_held({step("one", 0, "no model")}, Modality::thermal, temp.path()).value();
  EXPECT_EQ(error.found, "one: no model");
  EXPECT_FALSE(std::filesystem::exists(temp.path() / attempts_file));
}

TEST(NoneHeld, WhoeverRecordedVisibleViewsIsNotToldToRecordThem) {
  const test::TempFolder temp;
  const auto remedy = [&](const char* attempt) {
    return none_held({step(attempt, 0, "two starts")}, Modality::thermal, temp.path())
        .value()
        .remedy;
  };
  EXPECT_NE(remedy("COLMAP").find("record visible views"), std::string::npos);
  EXPECT_EQ(remedy("cross-modal, orbit prior").find("record visible views"), std::string::npos);
}

TEST(NoneHeld, AFolderThatTakesNoFileLeavesTheListInTheMessage) {
  const Error error = none_held({step("one", 0, "no model"), step("two", 2, "2/6 views")},
                                Modality::visible, "/dev/null/none")
                          .value();
  EXPECT_THAT(error.found, HasSubstr("the nearest, two: 2/6 views"));
  EXPECT_THAT(error.found, HasSubstr("one: no model"));
}

}  // namespace
}  // namespace orbitfuse
