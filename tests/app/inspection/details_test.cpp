// SPDX-License-Identifier: BSD-3-Clause
#include "app/inspection/details.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temp_folder.hpp"

namespace orbitfuse::inspection {
namespace {
using testing::HasSubstr;

void expect_refused(const std::string& toml, const std::string& where, const std::string& said) {
  const auto details = parse_details(toml, "mine.toml");
  ASSERT_FALSE(details) << toml;
  EXPECT_EQ(details.error().kind, ErrorKind::usage);
  EXPECT_EQ(details.error().where, where) << toml;
  EXPECT_THAT(details.error().message(), HasSubstr(said));
  EXPECT_FALSE(details.error().remedy.empty());
}

TEST(InspectionDetails, TheTemplateSaysNothingYet) {
  const auto details = parse_details(details_template(), "template");
  ASSERT_TRUE(details) << details.error().message();
  for (const auto& [key, text] : details->texts)
    EXPECT_EQ(text, key == "inspection.title" ? "Thermographic inspection" : "") << key;
  EXPECT_EQ(details->texts.size(), 28u) << "every key is in it";
  EXPECT_FALSE(details->emissivity);
  EXPECT_TRUE(details->findings.empty());
}

TEST(InspectionDetails, WhatTheTemplateShowsInCommentsHoldsAndIsTheDefault) {
  std::string shown(details_template());
  for (const char* line : {"# emissivity", "# reflected_c", "# distance_m", "# humidity", "# [[",
                           "# above_k", "# from_k", "# name", "# action", "# measurement",
                           "# title", "# component", "# reference", "# remark", "# recommendation"})
    for (std::size_t at = 0; (at = shown.find(std::string("\n") + line, at)) != std::string::npos;)
      shown.erase(at + 1, 2);
  const auto details = parse_details(shown, "template");
  ASSERT_TRUE(details) << details.error().message();
  EXPECT_EQ(details->emissivity, 0.95);
  ASSERT_EQ(details->findings.size(), 1u);
  EXPECT_EQ(details->findings[0].reference, "joint L1");
  const auto defaults = parse_details("", "nothing");
  ASSERT_TRUE(defaults);
  ASSERT_EQ(details->classes.size(), 3u);
  ASSERT_EQ(defaults->classes.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(details->classes[i].from_k, defaults->classes[i].from_k);
    EXPECT_EQ(details->classes[i].above, defaults->classes[i].above);
    EXPECT_EQ(details->classes[i].name, defaults->classes[i].name);
    EXPECT_EQ(details->classes[i].action, defaults->classes[i].action);
  }
}

TEST(InspectionDetails, WhatIsWrongIsNamedByFileAndLine) {
  expect_refused("[inspection]\nobject = \"pump\nplace = \"\"", "mine.toml:2", "print-template");
  expect_refused("[inspection]\nobjct = \"pump\"", "mine.toml:2", "inspection.object");
  expect_refused("\n[inspektion]\nobject = \"\"", "mine.toml:3", "inspektion.object");
  expect_refused("zebra = 5", "mine.toml:1", "unknown key 'zebra'");
  expect_refused("[inspection]\nobject = 5", "mine.toml:2", "a text in quotes");
  expect_refused("[radiometry]\nemissivity = \"0.9\"", "mine.toml:2", "a number of 0.01 to 1");
  expect_refused("[radiometry]\nemissivity = 1.5", "mine.toml:2", "0.01 to 1");
  expect_refused("[radiometry]\nemissivity = nan", "mine.toml:2", "0.01 to 1");
  expect_refused("[radiometry]\nemissivity = true", "mine.toml:2", "0.01 to 1");
  expect_refused("class = 3", "mine.toml:1", "[[class]]");
  expect_refused("class = [3]", "mine.toml:1", "[[class]]");
  expect_refused("[[class]]\nname = \"1\"", "mine.toml:1", "above_k");
  expect_refused("[[class]]\nabove_k = 1\nfrom_k = 2\nname = \"1\"", "mine.toml:1", "one of");
  expect_refused("[[class]]\nabove_k = -1\nname = \"1\"", "mine.toml:2", "0 to 10000");
  expect_refused("[[class]]\nabove_k = 1\nname = \"1\"\n[[class]]\nabove_k = 1\nname = \"2\"",
                 "mine.toml", "two classes from 1 K");
  expect_refused("[[finding]]\ntitle = \"x\"", "mine.toml:1", "name of a saved one");
  expect_refused("[[finding]]\nmeasurement = \"a\"\nremarks = \"x\"", "mine.toml:3", "'remark'");
  expect_refused("[[finding]]\nmeasurement = \"a\"\n[[finding]]\nmeasurement = \"a\"",
                 "mine.toml:3", "a second");
}

TEST(InspectionDetails, FilesThatAreNoneAreNamed) {
  const test::TempFolder folder;
  for (const auto& file : {folder / "absent.toml", std::filesystem::path("/dev/zero")}) {
    const auto details = read_details(file);
    ASSERT_FALSE(details);
    EXPECT_EQ(details.error().kind, ErrorKind::input);
    EXPECT_THAT(details.error().where, HasSubstr(file.filename().string()));
  }
}

TEST(InspectionDetails, ClassesComeMostUrgentFirst) {
  const auto details = parse_details(
      "[[class]]\nabove_k = 2\nname = \"low\"\n[[class]]\nabove_k = 40\nname = \"high\"", "x");
  ASSERT_TRUE(details) << details.error().message();
  ASSERT_EQ(details->classes.size(), 2u);
  EXPECT_EQ(details->classes[0].name, "high");
}

}  // namespace
}  // namespace orbitfuse::inspection
