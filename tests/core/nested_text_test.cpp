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

/// Which of the two is meant nobody knows.
TEST(NestedText, AKeyThatAnObjectHasTwiceIsNamedWithItsLine) {
  const auto fault = [](const std::string& text) {
    EXPECT_TRUE(parse_json(text).is_discarded()) << text;
    return json_fault(text);
  };
  const auto twice = [](const std::string& key, int line) {
    return "the key \"" + key + "\" twice in one object, the second time in line " +
           std::to_string(line);
  };
  EXPECT_EQ(fault(R"({"a":1,"a":1})"), twice("a", 1));
  EXPECT_EQ(fault("{\"a\": [\n {\"b\": \"a\",\n\n\"c\": {}, \"b\"\n : 2}]}"), twice("b", 4));
  EXPECT_EQ(fault(R"({"":{"x":1},"b":[{},{}],"":0})"), twice("", 1));
  EXPECT_EQ(fault(R"({"a":1,"\u0061":2})"), twice("a", 1)) << "the same key, written otherwise";
  EXPECT_EQ(fault(R"({"\"{":1,"x":"}","\"{":2})"), twice("\"{", 1));
  for (const char* text :
       {R"({"a":{"a":1},"b":{"a":"a"},"c":["a","a"]})", R"([{"a":1},{"a":1}])", R"("a")",
        R"({"a":"a","b":"a","A":1,"a ":{}})", R"({"\\":1,"\"":2,"\u005c\"":3})", "{}", "[[],[]]"})
    EXPECT_TRUE(!parse_json(text).is_discarded() && json_fault(text).empty()) << text;
  // Manifests have thousands of lines, transforms.json thousands of frames.
  std::string many = "{";
  for (int i = 0; i < 200'000; ++i) many += "\"" + std::to_string(i) + "\":{\"a\":1,\"b\":[]},\n";
  EXPECT_EQ(parse_json(many + "\"\":0}").size(), 200'001u);
  EXPECT_EQ(fault(many + "\"77\":0}"), twice("77", 200'001));
  EXPECT_NE(json_fault("{\"a\":1,\"a\":").find("not JSON"), std::string::npos) << "cut off";
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
