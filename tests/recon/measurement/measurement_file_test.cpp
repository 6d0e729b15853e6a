// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/measurement_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "recon/measurement/answer.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::measurement {
namespace {
using nlohmann::json;
using testing::HasSubstr;

SavedMeasurement spot(const std::string& name) {
  SavedMeasurement saved;
  saved.name = name;
  saved.request.places = {Eigen::Vector3d(1, 2, 3)};
  saved.answer = {{"kind", "spot"}, {"reading", {{"temperature_k", 300.5}}}};
  return saved;
}

class MeasurementFile : public testing::Test {
 protected:
  void expect_refused(const std::string& bytes, const std::string& found) const {
    test::put(file, bytes);
    const auto loaded = load_measurements(file, "run a");
    ASSERT_FALSE(loaded) << bytes;
    EXPECT_EQ(loaded.error().kind, ErrorKind::input);
    EXPECT_THAT(loaded.error().where, HasSubstr("measurements.json"));
    EXPECT_THAT(loaded.error().message(), HasSubstr(found));
    EXPECT_FALSE(loaded.error().remedy.empty());
    EXPECT_FALSE(add_measurement(file, "run a", spot("new")));
    EXPECT_EQ(test::get(file), bytes) << "nothing is lost";
  }
  test::TempFolder temp;
  std::filesystem::path file = temp / "measurements.json";
};

TEST_F(MeasurementFile, HoldsWhatWasPut) {
  EXPECT_TRUE(load_measurements(file, "run a")->list.empty()) << "an absent file is an empty list";
  SavedMeasurement first = spot("");
  first.remark = "loose";
  first.component = "clamp";
  first.reference = "spot 2";
  EXPECT_EQ(add_measurement(file, "run a", first).value().name, "spot 1");
  EXPECT_EQ(add_measurement(file, "run a", spot("")).value().name, "spot 2");
  EXPECT_EQ(add_measurement(file, "run a", spot("a \"valve\", hot")).value().name,
            "a \"valve\", hot");
  EXPECT_EQ(add_measurement(file, "run a", spot("two\nlines")).error().kind, ErrorKind::usage);
  SavedMeasurement again = spot("spot 1");
  again.answer["reading"]["temperature_k"] = 310;
  again.remark = "tightened";
  again.request.object.emissivity = 0.6;
  const auto kept = add_measurement(file, "run a", again);
  ASSERT_TRUE(kept);
  EXPECT_TRUE(kept->replaced) << "the caller can say so";
  EXPECT_EQ(kept->words, "component 'clamp' stays, reference 'spot 2' stays");
  const auto loaded = load_measurements(file, "run a");
  ASSERT_TRUE(loaded) << loaded.error().message();
  ASSERT_EQ(loaded->list.size(), 3u);
  EXPECT_EQ(loaded->list[0].answer["reading"]["temperature_k"], 310);
  EXPECT_EQ(loaded->list[0].created.size(), 20u);
  EXPECT_EQ(std::get<Eigen::Vector3d>(loaded->list[2].request.places.at(0)).z(), 3);
  EXPECT_EQ(loaded->list[0].remark, "tightened");
  EXPECT_EQ(loaded->list[0].component, "clamp") << "measured again, it is still of the clamp";
  EXPECT_EQ(loaded->list[0].reference, "spot 2");
  EXPECT_EQ(loaded->find("none"), nullptr);
  EXPECT_TRUE(loaded->notes.empty());
}

TEST_F(MeasurementFile, WordsOfAnotherPlaceGoWithIt) {
  SavedMeasurement first = spot("valve");
  first.remark = "loose";
  first.component = "clamp";
  ASSERT_TRUE(add_measurement(file, "run a", first));
  SavedMeasurement elsewhere = spot("valve");
  elsewhere.request.places = {Eigen::Vector3d(1, 2, 3.5)};
  elsewhere.component = "hinge";
  const auto kept = add_measurement(file, "run a", elsewhere);
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->words, "remark 'loose' went with the place that it was said of");
  const auto loaded = load_measurements(file, "run a");
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->list.at(0).remark, "");
  EXPECT_EQ(loaded->list.at(0).component, "hinge");
}

TEST_F(MeasurementFile, DistancesAreInTheMetresOfTodaysScale) {
  Measurements saved;
  SavedMeasurement span = spot("span");
  span.request.kind = Kind::distance;
  span.answer = {{"kind", "distance"},
                 {"distance", 2.0},
                 {"distance_m", 1.0},
                 {"distance_uncertainty_m", 0.1},
                 {"notes", {no_scale_note, "another"}}};
  saved.list = {span, spot("beside")};
  bring_to_scale(saved, 3.0, 0.01);
  EXPECT_DOUBLE_EQ(saved.list[0].answer["distance_m"].get<double>(), 6);
  EXPECT_NEAR(saved.list[0].answer["distance_uncertainty_m"].get<double>(), 0.06 * 1.645, 1e-12);
  EXPECT_EQ(saved.list[0].answer["notes"], json({"another", ends_unknown_note}));
  saved.list[0].answer["distance_uncertainty"] = 0.03;  // of its ends
  bring_to_scale(saved, 3.0, 0.01);
  EXPECT_NEAR(saved.list[0].answer["distance_uncertainty_m"].get<double>(),
              std::hypot(0.06 * 1.645, 0.09), 1e-12);
  EXPECT_EQ(saved.list[0].answer["notes"], json({"another"}));
  EXPECT_EQ(saved.list[1].answer, spot("beside").answer);
  bring_to_scale(saved, std::nullopt, 0);
  EXPECT_EQ(saved.list[0].answer["notes"], json({"another", no_scale_note}));
  EXPECT_TRUE(saved.list[0].answer["distance_m"].is_null());
  EXPECT_DOUBLE_EQ(saved.list[0].answer["distance"].get<double>(), 2);
  saved.list[0].answer = "spoilt";
  bring_to_scale(saved, 3.0, 0.01);
  EXPECT_EQ(saved.list[0].answer, "spoilt");
}

TEST_F(MeasurementFile, NamesHaveOneBound) {
  EXPECT_TRUE(add_measurement(file, "run a", spot(std::string(longest_name_bytes, 'n'))));
  const std::string before = test::get(file), longer(longest_name_bytes + 1, 'n');
  const auto refused = add_measurement(file, "run a", spot(longer));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::usage);
  EXPECT_THAT(refused.error().message(), HasSubstr("201 bytes"));
  EXPECT_THAT(refused.error().remedy, HasSubstr("up to 200 bytes"));
  EXPECT_EQ(test::get(file), before);
  // Of an earlier version: read, and can go.
  json j = json::parse(before);
  j["measurements"][0]["name"] = longer;
  test::put(file, j.dump());
  EXPECT_EQ(load_measurements(file, "run a")->list.at(0).name, longer);
  EXPECT_TRUE(remove_measurement(file, "run a", longer));
}

TEST_F(MeasurementFile, OneIsTakenOutByItsName) {
  for (const char* name : {"one", "two"}) ASSERT_TRUE(add_measurement(file, "run a", spot(name)));
  EXPECT_TRUE(remove_measurement(file, "run a", "one"));
  ASSERT_EQ(load_measurements(file, "run a")->list.size(), 1u);
  EXPECT_EQ(load_measurements(file, "run a")->list[0].name, "two");
  const std::string bytes = test::get(file);
  const Status gone = remove_measurement(file, "run a", "one");
  ASSERT_FALSE(gone);
  EXPECT_THAT(gone.error().found, HasSubstr("'one'"));
  EXPECT_FALSE(remove_measurement(file, "run b", "two"));
  EXPECT_EQ(test::get(file), bytes);
}

TEST_F(MeasurementFile, DamageIsNamedAndNothingIsLost) {
  ASSERT_TRUE(add_measurement(file, "run a", spot("one")));
  const std::string whole = test::get(file);
  expect_refused("", "not JSON");
  expect_refused("[]", "not a JSON object");
  expect_refused("{\"schema\":1,\n\"run\":\"a\",\n\"run\":\"b\"}",
                 "the key \"run\" twice in one object, the second time in line 3");
  expect_refused("{\"schema\":1,\n\"run\":", "cut off: parse error at line 2");
  expect_refused(whole.substr(0, whole.size() / 2), "cut off");
  json j = json::parse(whole);
  j["schema"] = 99;
  expect_refused(j.dump(), "99");
  j = json::parse(whole);
  j["measurements"] = 5;
  expect_refused(j.dump(), "no list");
  j = json::parse(whole);
  j["measurements"].push_back(j["measurements"][0]);
  expect_refused(j.dump(), "two measurements named 'one'");
  j = json::parse(whole);
  j["measurements"][0].erase("name");
  expect_refused(j.dump(), "measurements[0]");
  j = json::parse(whole);
  j["measurements"][0]["request"]["kind"] = "sport";
  expect_refused(j.dump(), "sport");
  j = json::parse(whole);
  j["measurements"][0]["answer"]["reading"]["temperature_k"] = "warm";
  expect_refused(j.dump(), "'one': answer.reading.temperature_k");
  j = json::parse(whole);
  j.erase("run");
  expect_refused(j.dump(), "no run");
}

TEST_F(MeasurementFile, MorePlacesThanAreMeasuredNowAreReadAndNamed) {
  SavedMeasurement many = spot("many");
  many.request.kind = Kind::hottest;
  many.request.places.clear();
  many.answer = {{"kind", "hottest"}, {"spots", json::array()}};
  ASSERT_TRUE(add_measurement(file, "run a", many));
  json j = json::parse(test::get(file));
  j["measurements"][0]["request"]["count"] = 250;
  test::put(file, j.dump());
  const auto loaded = load_measurements(file, "run a");
  ASSERT_TRUE(loaded) << loaded.error().message();
  EXPECT_EQ(loaded->list.at(0).request.count, most_places);
  ASSERT_EQ(loaded->notes.size(), 1u);
  EXPECT_THAT(loaded->notes[0], HasSubstr("measurements[0] 'many'"));
  j["measurements"][0]["request"]["count"] = -3;
  expect_refused(j.dump(), "count");
  j["measurements"][0]["request"]["count"] = 5;
  j["measurements"][0]["remark"] = 7;
  expect_refused(j.dump(), "not a text");
}

TEST_F(MeasurementFile, AnotherRunsAreNotTaken) {
  ASSERT_TRUE(add_measurement(file, "run b", spot("one")));
  expect_refused(test::get(file), "another run");
}

TEST_F(MeasurementFile, ProgramsThatSaveAtOnceLoseNothing) {
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (int i = 0; i < 5; ++i)
        EXPECT_TRUE(add_measurement(file, "run a", spot(std::to_string(10 * t + i))));
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(load_measurements(file, "run a")->list.size(), 20u);
}

TEST_F(MeasurementFile, WhatCouldNotBeReadAgainIsNotWritten) {
  ASSERT_TRUE(add_measurement(file, "run a", spot("one")));
  const std::string before = test::get(file);
  SavedMeasurement large = spot("large");
  large.answer["hidden"] = std::string(257u << 20, 'x');
  const auto refused = add_measurement(file, "run a", large);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().found, HasSubstr("it may hold 256 MB"));
  EXPECT_EQ(test::get(file), before);
}

TEST_F(MeasurementFile, AFolderInItsPlaceIsSaid) {
  std::filesystem::create_directories(file);
  EXPECT_FALSE(load_measurements(file, "run a"));
  EXPECT_FALSE(add_measurement(temp / "gone" / "measurements.json", "run a", spot("x")));
}

}  // namespace
}  // namespace orbitfuse::measurement
