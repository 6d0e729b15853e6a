// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/csv.hpp"

#include <gtest/gtest.h>

namespace orbitfuse {
namespace {

TEST(Csv, TextIsQuotedWhereItMust) {
  EXPECT_EQ(csv_text("bearing 3"), "bearing 3");
  EXPECT_EQ(csv_text("a,b"), "\"a,b\"");
  EXPECT_EQ(csv_text("the \"hot\" one"), "\"the \"\"hot\"\" one\"");
  EXPECT_EQ(csv_text("two\nlines\r"), "two lines ");
  EXPECT_EQ(csv_text(""), "");
}

TEST(Csv, NoSpreadsheetRunsIt) {
  for (const char* text : {"=cmd|' /C calc'!A0", "+1", "-1+1", "@SUM(A1)", "\t=1"})
    EXPECT_EQ(csv_text(text).find_first_of("'"), csv_text(text)[0] == '"' ? 1U : 0U) << text;
}

}  // namespace
}  // namespace orbitfuse
