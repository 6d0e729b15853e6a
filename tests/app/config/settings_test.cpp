// SPDX-License-Identifier: BSD-3-Clause
#include "app/config/settings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temp_folder.hpp"

namespace orbitfuse::config {
namespace {
using testing::HasSubstr;

enum class Kind { fast, faithful };

struct Options {
  double budget_s = 60;
  std::optional<double> elevation_deg;
  float weight = 0.1F;
  int views = 12;
  bool shared = true;
  std::string palette = "inferno";
  std::vector<std::string> methods = {"a", "b"};
  Kind kind = Kind::fast;
};

struct SettingsTest : testing::Test {
  SettingsTest() {
    settings.add("train.visible.budget_s", options.budget_s, "time to train");
    settings.add("train.visible.weight", options.weight, "a weight");
    settings.add("render.elevation_deg", options.elevation_deg, "of the orbit");
    settings.add("render.views", options.views, "views on the orbit");
    settings.add("train.shared", options.shared, "share geometry");
    settings.add("render.palette", options.palette, "colours");
    settings.add("fusion.methods", options.methods, "methods");
    settings.add_choice("train.kind", options.kind,
                        {{Kind::fast, "fast"}, {Kind::faithful, "faithful"}}, "recipe");
  }
  Status read(const std::string& text) {
    const auto file = temp.path() / "config.toml";
    std::ofstream(file) << text;
    return settings.read_toml(file);
  }
  test::TempFolder temp;
  Options options;
  Settings settings;
};

TEST_F(SettingsTest, ReadsEveryType) {
  ASSERT_TRUE(
      read("[train.visible]\nbudget_s = 5\nweight = 0.25\n[render]\nviews = 3\npalette = 'x'\n"
           "[train]\nshared = false\nkind = 'faithful'\n[fusion]\nmethods = ['c']\n"));
  EXPECT_EQ(options.budget_s, 5);
  EXPECT_EQ(options.weight, 0.25F);
  EXPECT_EQ(options.views, 3);
  EXPECT_FALSE(options.shared);
  EXPECT_EQ(options.palette, "x");
  EXPECT_EQ(options.kind, Kind::faithful);
  EXPECT_THAT(options.methods, testing::ElementsAre("c"));
}

TEST_F(SettingsTest, UnknownKeyNamesLineAndSuggestion) {
  const Status status = read("[render]\nviews = 3\nviewz = 4\n");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::usage);
  EXPECT_THAT(status.error().message(), HasSubstr("config.toml:3"));
  EXPECT_THAT(status.error().message(), HasSubstr("did you mean 'render.views'?"));
}

TEST_F(SettingsTest, WrongTypeSaysWhatItMustBe) {
  EXPECT_THAT(read("[render]\nviews = 2.5\n").error().message(), HasSubstr("must be an integer"));
  EXPECT_THAT(read("[train]\nkind = 'slow'\n").error().message(),
              HasSubstr("one of fast faithful"));
  EXPECT_THAT(read("[render]\nviews = 99999999999999999999\n").error().message(), HasSubstr(":2"));
  EXPECT_THAT(read("[fusion]\nmethods = [1]\n").error().message(), HasSubstr("list"));
}

TEST_F(SettingsTest, ListsAndTablesAreNamedAsTheyWereWritten) {
  const std::tuple<std::string, std::string, std::string> cases[] = {
      {"[fusion]\nmethods = [1]\n", "config.toml:2: fusion.methods = [ 1 ]",
       "it must be a list of texts, e.g. [\"heat\", \"best\"]"},
      {"[fusion]\nmethods = 'heat'\n", "fusion.methods = 'heat'", "a list of texts"},
      {"[render]\nviews = {a = 1}\n", "render.views = a table", "an integer"},
      {"[render]\nviews = 2020-01-01\n", "render.views = 2020-01-01", "an integer"},
      {"[render]\nviews = nan\n", "render.views = nan", "an integer"},
      {"[render]\nviews = 5000000000\n", "render.views = 5000000000", "an integer nearer to 0"},
      {"render = 3\n", "render = 3", "render is a table of settings: give one of them"},
      {"[nonsense]\n", "unknown key 'nonsense'", "lists every key"}};
  for (const auto& [text, found, wanted] : cases) {
    const Status status = read(text);
    ASSERT_FALSE(status) << text;
    EXPECT_THAT(status.error().message(), testing::AllOf(HasSubstr(found), HasSubstr(wanted)));
  }
  EXPECT_TRUE(read("[render]\n[train.visible]\n")) << "nothing in it";
}

TEST_F(SettingsTest, AnOptionalNumberIsANumberOrAuto) {
  EXPECT_EQ(settings.to_json("render").at("elevation_deg"), "auto");
  ASSERT_TRUE(settings.apply("render.elevation_deg=-12.5"));
  EXPECT_EQ(options.elevation_deg, -12.5);
  EXPECT_FALSE(settings.apply("render.elevation_deg=low"));
  EXPECT_EQ(options.elevation_deg, -12.5);
  ASSERT_TRUE(settings.apply("render.elevation_deg=auto"));
  EXPECT_FALSE(options.elevation_deg);
}

TEST_F(SettingsTest, BrokenTomlNamesTheLine) {
  EXPECT_THAT(read("[render]\nviews = = 3\n").error().message(), HasSubstr("config.toml:2"));
}

TEST_F(SettingsTest, Overrides) {
  ASSERT_TRUE(settings.apply("render.palette=rainbow"));
  EXPECT_EQ(options.palette, "rainbow");
  ASSERT_TRUE(settings.apply("train.visible.budget_s=1.5"));
  EXPECT_EQ(options.budget_s, 1.5);
  EXPECT_THAT(settings.apply("budget_s=1").error().message(),
              HasSubstr("did you mean 'train.visible.budget_s'?"));
  EXPECT_FALSE(settings.apply("render.views"));
}

TEST_F(SettingsTest, WhatARecordCannotHoldIsRefused) {
  const Status status = settings.apply("render.palette=\xff");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::usage);
  EXPECT_THAT(status.error().message(), HasSubstr("UTF-8"));
  EXPECT_EQ(options.palette, "inferno");
  ASSERT_TRUE(settings.apply("render.palette=\u00e9"));
}

TEST_F(SettingsTest, RecordsOfWrongTypesNameTheKey) {
  using nlohmann::json;
  const std::pair<const char*, const char*> cases[] = {
      {R"({"train":7})", "train = 7"},
      {R"({"train":{"visible":[1]}})", "train.visible = [1]"},
      {R"({"render":{"views":"x"}})", "render.views = \"x\""},
      {R"({"render":{"views":null}})", "render.views = null"}};
  for (const auto& [text, named] : cases) {
    const Status status = settings.read_json(json::parse(text), "run.json");
    ASSERT_FALSE(status) << text;
    EXPECT_THAT(status.error().message(), HasSubstr("run.json: "));
    EXPECT_THAT(status.error().message(), HasSubstr(named));
  }
  EXPECT_TRUE(
      settings.read_json(json::parse(R"({"of another version":{"x":1},"render":{}})"), "run.json"));
}

TEST_F(SettingsTest, TomlReferenceReadsBackToTheSameValues) {
  const auto before = settings.to_json();
  EXPECT_THAT(settings.to_toml(), HasSubstr("weight = 0.1\n"));
  options.budget_s = -1;
  options.views = -1;
  Options defaults;
  std::swap(options, defaults);
  ASSERT_TRUE(read(settings.to_toml()));
  EXPECT_EQ(settings.to_json(), before);
  EXPECT_EQ(settings.to_json("train.visible").at("weight"), 0.1);
}

TEST(Nearest, OnlyOffersLikelySlips) {
  EXPECT_EQ(nearest("ms-sirf", {"ms-srif", "pca-msif"}), "ms-srif");
  EXPECT_EQ(nearest("completely-different", {"ms-srif"}), "");
}

}  // namespace
}  // namespace orbitfuse::config
