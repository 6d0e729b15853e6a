// SPDX-License-Identifier: BSD-3-Clause
#include "core/json_fields.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/geometry/geometry_json.hpp"

namespace orbitfuse {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

JsonFields fields_of(const json& j) { return {j, "file: ", {ErrorKind::input, "mend it"}}; }

TEST(JsonFields, ReadsWhatIsThere) {
  const json j = {{"number", 2.5},       {"count", 7},
                  {"yes", true},         {"text", "a"},
                  {"texts", {"a", "b"}}, {"pair", {1, 2}},
                  {"point", {1, 2, 3}},  {"points", {{1, 2, 3}, {4, 5, 6}}},
                  {"null", nullptr}};
  double number = 0, other = 5;
  int count = 0;
  bool yes = false;
  std::string text;
  std::vector<std::string> texts;
  std::array<double, 2> pair{};
  Eigen::Vector3d point;
  std::vector<Eigen::Vector3d> points;
  std::optional<double> given, not_given;
  const JsonFields fields = fields_of(j);
  ASSERT_TRUE(fields.get_all("number", number, "count", count, "yes", yes, "text", text, "texts",
                             texts, "pair", pair, "point", point, "points", points));
  ASSERT_TRUE(fields.get_present("null", other, "number", given, "absent", not_given));
  EXPECT_EQ(number, 2.5);
  EXPECT_EQ(count, 7);
  EXPECT_TRUE(yes);
  EXPECT_EQ(text, "a");
  EXPECT_EQ(texts, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(pair[1], 2);
  EXPECT_EQ(point, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(points.at(1), Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(other, 5) << "null counts as not there";
  EXPECT_EQ(given, 2.5);
  EXPECT_FALSE(not_given);
}

TEST(JsonFields, NamesWhatIsWrongAndLeavesTheValueAsItWas) {
  const json j = {{"half", 2.5},
                  {"text", "a"},
                  {"huge", 18446744073709551610U},
                  {"below", -1},
                  {"mixed", {"a", 1}},
                  {"pair", {1, "b"}},
                  {"list", {{{"x", 1}}, 5}},
                  {"inner", {{"x", "a"}}}};
  const JsonFields fields = fields_of(j);
  double number = 9;
  int whole = 9;
  std::int64_t time = 9;
  std::uint64_t count = 9;
  std::vector<std::string> texts = {"kept"};
  std::array<double, 2> pair{9, 9};
  const auto expect = [](const Status& status, const char* where, const char* found,
                         const char* remedy) {
    ASSERT_FALSE(status) << where;
    EXPECT_EQ(status.error().where, where);
    EXPECT_EQ(status.error().found, found);
    EXPECT_EQ(status.error().remedy, std::string("must be ") + remedy + ": mend it");
  };
  expect(fields.get("absent", number), "file: absent", "missing", "a number");
  expect(fields.get("text", number), "file: text", "\"a\"", "a number");
  expect(fields.get("half", whole), "file: half", "2.5", "a whole number");
  expect(fields.get("half", number, from_to(0, 1)), "file: half", "2.5", "a number, 0 to 1");
  EXPECT_FALSE(fields.get("huge", whole));
  EXPECT_FALSE(fields.get("huge", time));
  EXPECT_FALSE(fields.get("huge", count)) << "it would wrap where it is counted on";
  EXPECT_FALSE(fields.get("below", count));
  EXPECT_FALSE(fields.get("mixed", texts));
  EXPECT_FALSE(fields.get("pair", pair));
  EXPECT_EQ(number, 9);
  EXPECT_EQ(whole, 9);
  EXPECT_EQ(time, 9);
  EXPECT_EQ(count, 9u);
  EXPECT_EQ(texts.at(0), "kept");
  EXPECT_EQ(pair[0], 9);

  const auto inner = fields.child("inner");
  ASSERT_TRUE(inner);
  expect(inner->get("x", number), "file: inner.x", "\"a\"", "a number");
  EXPECT_EQ(fields.children("list").error().where, "file: list[1]");
  EXPECT_FALSE(fields.child("list"));
  EXPECT_EQ(fields.check_keys({"half"}).error().found, "unknown");
}

TEST(JsonFields, OfWhatIsNoObjectNothingIsThere) {
  const json list = {1, 2};
  double number = 0;
  EXPECT_FALSE(fields_of(list).get("x", number));
  EXPECT_EQ(fields_of(list).check_object().error().where, "file");
}

TEST(GeometryJson, CamerasAndTransformsComeBackAsTheyWere) {
  Camera camera = Camera::from_fov(640, 480, 55);
  const json pinhole = pinhole_json(camera);
  EXPECT_EQ(camera_of_json(fields_of(pinhole)), camera);
  camera.k1 = -0.1;
  camera.p2 = 0.01;
  json bent = camera_json(camera);
  EXPECT_EQ(camera_of_json(fields_of(bent)), camera);
  bent.erase("k2");
  EXPECT_THAT(camera_of_json(fields_of(bent)).error().where, HasSubstr("k2"))
      << "half a lens is none";

  const Similarity3d a{2.5, Eigen::Quaterniond(0.8, 0, 0.6, 0), {1, 2, 3}};
  json similarity = similarity_json(a);
  const auto back = similarity_of_json(fields_of(similarity));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->matrix(), a.matrix());
  similarity["scale"] = 0;
  EXPECT_FALSE(similarity_of_json(fields_of(similarity)));
  similarity["scale"] = 1;
  similarity["rotation_wxyz"] = {1, 1, 0, 0};
  EXPECT_FALSE(similarity_of_json(fields_of(similarity)));
}

}  // namespace
}  // namespace orbitfuse
