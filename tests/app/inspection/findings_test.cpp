// SPDX-License-Identifier: BSD-3-Clause
#include "app/inspection/findings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/app/inspection/saved_spots.hpp"

namespace orbitfuse::inspection {
namespace {
using measurement::Kind;
using testing::HasSubstr;

Result<std::vector<InspectionFinding>> findings(
    const std::vector<measurement::SavedMeasurement>& list, const std::string& toml = "") {
  const auto details = parse_details(toml, "mine.toml");
  if (!details) return tl::unexpected(details.error());
  return findings_of({"", list, {}}, *details);
}

std::string finding_toml(const std::string& measurement, const std::string& reference) {
  return "[[finding]]\nmeasurement = \"" + measurement + "\"\nreference = \"" + reference + "\"\n";
}

TEST(InspectionFindings, AreOrderedByTheDetailsThenAsSaved) {
  const auto list = findings({spot_at("a", 300), spot_at("b", 301), spot_at("c", 302)},
                             "[[finding]]\nmeasurement = \"c\"\ntitle = \"Third\"\n");
  ASSERT_TRUE(list) << list.error().message();
  ASSERT_EQ(list->size(), 3u);
  EXPECT_EQ((*list)[0].title, "Third");
  EXPECT_EQ((*list)[1].title, "a") << "without a title its name stands";
  EXPECT_EQ((*list)[2].number, 3);
  EXPECT_FALSE((*list)[0].comparison);
}

TEST(InspectionFindings, ADifferenceHasItsClassAndWhatElseItMayBe) {
  struct Case {
    double difference_k;
    const char* name;
    const char* or_else;
  };
  // Each spot's uncertainty is 0.3 K, the difference's 0.42 K.
  for (const Case& c : {Case{0.2, "", ""}, Case{0.9, "", "class 3"}, Case{1.0, "3", "below"},
                        Case{2.0, "3", ""}, Case{2.9, "3", "class 2"}, Case{3.1, "2", "class 3"},
                        Case{-8.0, "2", ""}, Case{15.0, "2", "class 1"}, Case{40, "1", ""}}) {
    const auto list = findings({spot_at("hot", 300 + c.difference_k), spot_at("like", 300)},
                               finding_toml("hot", "like"));
    ASSERT_TRUE(list) << list.error().message();
    const Comparison& comparison = *(*list)[0].comparison;
    EXPECT_NEAR(comparison.difference_k, c.difference_k, 1e-9);
    EXPECT_NEAR(comparison.uncertainty_k, std::hypot(0.3, 0.3), 1e-9);
    EXPECT_EQ(comparison.priority ? comparison.priority->name : "", c.name) << c.difference_k;
    EXPECT_EQ(comparison.or_else.empty(), *c.or_else == 0) << c.difference_k;
    EXPECT_THAT(comparison.or_else, HasSubstr(c.or_else)) << c.difference_k;
    EXPECT_THAT((*list)[1].reference_of, testing::ElementsAre("hot"));
  }
}

TEST(InspectionFindings, TheMeasurementsOwnWordsHoldWhereTheDetailsSayNothing) {
  auto hot = spot_at("hot", 310);
  hot.remark = "as saved";
  hot.component = "clamp";
  hot.reference = "like";
  const auto list = findings({hot, spot_at("like", 300), spot_at("other", 305)},
                             "[[finding]]\nmeasurement = \"hot\"\nremark = \"as told\"\n");
  ASSERT_TRUE(list) << list.error().message();
  EXPECT_EQ((*list)[0].remark, "as told");
  EXPECT_EQ((*list)[0].component, "clamp");
  EXPECT_EQ((*list)[0].comparison->with, "like");
}

TEST(InspectionFindings, ReferencesThatAreNoneAreNamed) {
  auto distance = spot_at("far", 300);
  distance.request.kind = Kind::distance;
  distance.answer = {{"kind", "distance"}, {"distance", 2.0}};
  const std::vector<measurement::SavedMeasurement> saved{spot_at("hot", 310), spot_at("like", 300),
                                                         distance};
  for (const auto& [toml, said] :
       {std::pair(finding_toml("hott", "like"), "did you mean 'hot'?"),
        std::pair(finding_toml("hot", "likes"), "did you mean 'like'?"),
        std::pair(finding_toml("hot", "zebra crossing"), "no saved measurement is named"),
        std::pair(finding_toml("hot", "hot"), "its own reference"),
        std::pair(finding_toml("hot", "far"), "'far' is a distance"),
        std::pair(finding_toml("far", "hot"), "'far' is a distance")}) {
    const auto list = findings(saved, toml);
    ASSERT_FALSE(list) << toml;
    EXPECT_EQ(list.error().kind, ErrorKind::usage);
    EXPECT_EQ(list.error().where, "mine.toml:1");
    EXPECT_THAT(list.error().message(), HasSubstr(said));
  }
  auto hot = spot_at("hot", 310);
  hot.reference = "gone";
  const auto list = findings({hot});
  ASSERT_TRUE(list) << "it was removed on the viewer's page: the rest of the report is right";
  ASSERT_TRUE(list->front().comparison);
  EXPECT_FALSE(list->front().comparison->known());
  EXPECT_THAT(list->front().comparison->with, HasSubstr("gone (no longer saved)"));
  EXPECT_TRUE(list->front().comparison->reference_gone);
}

TEST(InspectionFindings, WhatNoFrameSawHasNoDifference) {
  const auto list =
      findings({unseen_spot("dark"), spot_at("like", 300)}, finding_toml("dark", "like"));
  ASSERT_TRUE(list) << list.error().message();
  EXPECT_FALSE((*list)[0].reading().seen());
  EXPECT_FALSE((*list)[0].comparison->known());
  EXPECT_FALSE((*list)[0].comparison->reference_gone);
  EXPECT_FALSE((*list)[0].comparison->priority);
}

TEST(InspectionFindings, ASavedDifferenceIsItsOwnComparison) {
  auto saved = spot_at("two", 300);
  saved.answer = {{"kind", "difference"},
                  {"difference_k", 5.0},
                  {"uncertainty_k", 0.5},
                  {"of", {spot_at("a", 305).answer, spot_at("b", 300).answer}}};
  const auto list = findings({saved});
  ASSERT_TRUE(list) << list.error().message();
  EXPECT_EQ((*list)[0].comparison->priority->name, "2");
  EXPECT_EQ((*list)[0].reading().temperature_k, 305);
  EXPECT_TRUE((*list)[0].position());
}

TEST(InspectionFindings, OtherObjectParametersAreSaidBesideTheDifference) {
  auto hot = spot_at("hot", 310), like = spot_at("like", 300), two = spot_at("two", 300);
  const auto same = findings({hot, like}, finding_toml("hot", "like"));
  ASSERT_TRUE(same);
  EXPECT_EQ((*same)[0].comparison->caution, std::nullopt);
  like.answer["radiometry"] = {
      {"emissivity", 0.6}, {"reflected_k", 293.15}, {"words", "emissivity 0.60 as asked"}};
  two.answer = {{"kind", "difference"},
                {"difference_k", 5.0},
                {"uncertainty_k", 0.5},
                {"of", {hot.answer, like.answer}}};
  const auto list = findings({hot, like, two}, finding_toml("hot", "like"));
  ASSERT_TRUE(list) << list.error().message();
  for (const std::size_t i : {0u, 2u})
    EXPECT_THAT((*list)[i].comparison->caution.value_or(""),
                HasSubstr("emissivity 0.95, as recorded; against emissivity 0.60 as asked"));
}

TEST(InspectionFindings, AnAnswerOfAnotherShapeIsNamed) {
  auto broken = spot_at("broken", 300);
  broken.answer["reading"]["temperature_k"] = "hot";
  const auto list = findings({broken});
  ASSERT_FALSE(list);
  EXPECT_EQ(list.error().kind, ErrorKind::input);
  EXPECT_THAT(list.error().where, HasSubstr("'broken': answer.reading.temperature_k"));
}

}  // namespace
}  // namespace orbitfuse::inspection
