// SPDX-License-Identifier: BSD-3-Clause
#include "core/nested_text.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

std::string levels(int n) {
  return std::string(static_cast<std::size_t>(n), '[') +
         std::string(static_cast<std::size_t>(n), ']');
}

TEST(NestedText, JsonUpToTheLimitIsReadAndNoDeeper) {
  EXPECT_TRUE(parse_json(levels(max_nesting)).is_array());
  EXPECT_TRUE(parse_json(levels(max_nesting + 1)).is_discarded());
  EXPECT_TRUE(parse_json(levels(1'000'000)).is_discarded());
  EXPECT_TRUE(parse_json(std::string(1'000'000, '[')).is_discarded());
  std::string objects = "1";
  for (int i = 0; i <= max_nesting; ++i) objects = "{\"a\":" + objects + "}";
  EXPECT_TRUE(parse_json(objects).is_discarded());
}

TEST(NestedText, BracketsInStringsAndBesideEachOtherAreNoLevels) {
  const std::string brackets(1000, '[');
  EXPECT_EQ(parse_json("\"" + brackets + "\"").get<std::string>(), brackets);
  EXPECT_EQ(parse_json("[\"\\\"" + brackets + "\"]")[0].get<std::string>(), "\"" + brackets);
  std::string beside = "[[]";
  for (int i = 0; i < 1000; ++i) beside += ",[]";
  EXPECT_EQ(parse_json(beside + "]").size(), 1001u);
  EXPECT_TRUE(parse_json("").is_discarded());
  EXPECT_TRUE(parse_json("[1,").is_discarded());
  EXPECT_TRUE(parse_json("]]]]").is_discarded());
}

TEST(NestedText, KeysOfManyPartsAreNamedWithTheirLine) {
  const test::TempFolder folder;
  const auto read = [&](const std::string& text) {
    test::put(folder / "c.toml", text);
    return read_toml_text(folder / "c.toml");
  };
  std::string key = "a";
  for (int i = 0; i < 200; ++i) key += ".a";
  for (const std::string& line : {key + " = 1", "[" + key + "]", "b = {" + key + " = 1}"}) {
    const auto text = read("# first\n" + line + "\n");
    ASSERT_FALSE(text) << line;
    EXPECT_NE(text.error().where.find("c.toml:2"), std::string::npos) << text.error().where;
  }
  std::string list = "x = [0.5";
  for (int i = 0; i < 500; ++i) list += ", 0.5";
  const std::string dots(500, '.');
  for (const std::string& text :
       {list + "]\n", "# " + dots + "\na = 1", "a = \"" + dots + "\"", "a = '" + dots + "'",
        std::string("a.b.c = 1"), std::string(), "a = \"\\\"" + dots}) {
    const auto same = read(text);
    ASSERT_TRUE(same) << same.error().message();
    EXPECT_EQ(*same, text);
  }
  EXPECT_FALSE(read_toml_text("/dev/zero"));
  EXPECT_FALSE(read_toml_text(folder / "absent.toml"));
}

}  // namespace
}  // namespace orbitfuse
