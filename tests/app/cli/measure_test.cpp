// SPDX-License-Identifier: BSD-3-Clause
// `orbitfuse measure` on a small run of the real program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>

#include "core/system/file_io.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/app/cli/session_fixture.hpp"
#include "tests/app/cli/small_run.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

/// One copy of a run for all tests: they read it, and each removes what it saved.
class Measure : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = std::make_unique<test::TempFolder>();
    copy_results(made_run(), out());
  }
  static void TearDownTestSuite() { folder.reset(); }
  void SetUp() override { fs::remove(file()); }

  static fs::path session() { return made_run().session; }
  static fs::path out() { return *folder / "out"; }
  static fs::path file() { return out() / "measurements.json"; }
  static Outcome measure(std::vector<std::string> more) {
    more.insert(more.begin(), {"measure", out().string()});
    return orbitfuse_program(more);
  }
  static void expect_refused(const std::vector<std::string>& words, int code,
                             const std::string& said) {
    const Outcome refused = measure(words);
    EXPECT_EQ(refused.code, code) << refused.out << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(said));
    EXPECT_EQ(refused.out, "");
  }

  static std::unique_ptr<test::TempFolder> folder;
};
std::unique_ptr<test::TempFolder> Measure::folder;

TEST_F(Measure, ASpotIsTheFixturesTemperature) {
  const Outcome spot = measure({"--pixel", "thermal/000000.tiff,48,36", "--json"});
  ASSERT_EQ(spot.code, 0) << spot.err;
  const json answer = spot.result().at("answer");
  const json reading = answer.at("reading");
  // 290 to 310 K by a pattern on the cube.
  EXPECT_GT(reading.at("temperature_k").get<double>(), 290);
  EXPECT_LT(reading.at("temperature_k").get<double>(), 310);
  EXPECT_NEAR(reading.at("temperature_k").get<double>(), reading.at("field_k").get<double>(), 3);
  EXPECT_GT(reading.at("uncertainty_k").get<double>(), 0);
  EXPECT_GE(reading.at("frames").size(), 1u);
  // The same place by its point.
  const json p = answer.at("point");
  std::ostringstream word;
  word.precision(12);
  word << p[0].get<double>() << "," << p[1].get<double>() << "," << p[2].get<double>();
  const Outcome point = measure({"--point=" + word.str(), "--json"});
  ASSERT_EQ(point.code, 0) << point.err;
  EXPECT_NEAR(point.result()["answer"]["reading"]["temperature_k"].get<double>(),
              reading.at("temperature_k").get<double>(), 0.5);
}

TEST_F(Measure, RenderedAndVisibleViewsNamePlacesToo) {
  for (const char* pixel : {"000,32,24", "visible/000001.png,48,36"}) {
    const Outcome spot = measure({"--pixel", pixel});
    EXPECT_EQ(spot.code, 0) << spot.err;
    EXPECT_THAT(spot.out, HasSubstr(" C +- "));
    EXPECT_THAT(spot.out, HasSubstr("), best seen at thermal/0000"));
    EXPECT_THAT(spot.out, HasSubstr("emissivity not recorded"));
    EXPECT_THAT(spot.err, HasSubstr("+- covers the error in 90 of 100 cases"));
  }
  EXPECT_EQ(measure({"--distance", "000,32,24", "001,32,24"}).code, 0);
  const Outcome line = measure({"--line", "000,28,24", "000,36,24", "--profile", "5", "--csv"});
  ASSERT_EQ(line.code, 0) << line.err;
  EXPECT_EQ(std::count(line.out.begin(), line.out.end(), '\n'), 7) << line.out;
  EXPECT_TRUE(line.out.starts_with("name,kind,temperature_c"));
}

TEST_F(Measure, WhatIsSavedIsListedAndStandsForItsPlace) {
  ASSERT_EQ(measure({"--pixel", "000,32,24", "--name", "front", "--save"}).code, 0);
  ASSERT_EQ(measure({"--hottest", "2", "--save"}).code, 0);
  const Outcome list = measure({});
  EXPECT_EQ(list.code, 0);
  EXPECT_THAT(list.out, HasSubstr("front"));
  EXPECT_THAT(list.out, HasSubstr("hottest 1"));
  const Outcome difference = measure({"--difference", "hottest 1", "front", "--json"});
  ASSERT_EQ(difference.code, 0) << difference.err;
  EXPECT_GE(difference.result()["answer"]["difference_k"].get<double>(), -1);
  EXPECT_THAT(measure({"--pixel", "000,32,24", "--name", "front", "--save"}).err,
              HasSubstr("in place of the one of that name"));
  ASSERT_EQ(
      measure({"--pixel", "000,32,24", "--name", "front", "--save", "--remark", "glows"}).code, 0);
  EXPECT_THAT(measure({"--pixel", "000,32,24", "--name", "front", "--save"}).err,
              HasSubstr("remark 'glows' stays"));
  EXPECT_THAT(measure({"--pixel", "001,32,24", "--name", "front", "--save"}).err,
              HasSubstr("remark 'glows' went with the place"));
  const std::string before = test::get(file());
  ASSERT_EQ(measure({"--hottest", "1"}).code, 0);
  EXPECT_EQ(test::get(file()), before) << "without --save nothing is written";
}

TEST_F(Measure, DamagedAndForeignMeasurementsAreNamedAndKept) {
  ASSERT_EQ(measure({"--pixel", "000,32,24", "--save"}).code, 0);
  json foreign = json::parse(test::get(file()));
  foreign["run"] = "another";
  for (const auto& [bytes, said] : {std::pair(std::string("{\"schema\": 1, "), "cut off"),
                                    std::pair(foreign.dump(), "another run")}) {
    test::put(file(), bytes);
    expect_refused({"--pixel", "000,32,24", "--save"}, 3, said);
    expect_refused({}, 3, said);
    EXPECT_EQ(test::get(file()), bytes);
    const Outcome looking = measure({"--pixel", "000,32,24"});
    EXPECT_EQ(looking.code, 0) << "looking goes on";
    EXPECT_THAT(looking.err, HasSubstr(said));
  }
}

TEST_F(Measure, WhatIsStoppedSaysNothingOfResuming) {
  test::put(file(), "{}");  // a warning before the work begins
  RunOptions options;
  options.interrupt_after = "measurements.json";
  const Outcome stopped =
      orbitfuse_program({"measure", out().string(), "--hottest", "100"}, options);
  EXPECT_TRUE(stopped.code == 0 || stopped.code == 130) << stopped.code << stopped.err;
  EXPECT_EQ(stopped.code == 130, stopped.err.find("call it again") != std::string::npos)
      << stopped.err;
  EXPECT_EQ(stopped.err.find("--resume"), std::string::npos);
}

TEST_F(Measure, WhatIsWrongIsNamedWithTheRemedy) {
  expect_refused({"--pixel", "thermal/9.tiff,1,1"}, 3, "thermal/00");
  expect_refused({"--pixel", "000,9999,1"}, 3, "outside of the picture");
  expect_refused({"--point=99,99,99"}, 3, "outside of the scene");
  expect_refused({"--pixel", "000"}, 2, "VIEW,U,V");
  expect_refused({"--point", "1,2"}, 2, "X,Y,Z");
  expect_refused({"--point", "1,nan,2"}, 2, "point");
  expect_refused({"--box", "0,0,0,1,0,1"}, 2, "--box: size 0; choose above 0");
  // By what was typed: the library's keys and units stand in no help.
  for (const std::string kind : {"--hottest", "--coldest"})
    for (const std::string count : {"-1", "0", "1000000000", "nan", "1e9"})
      EXPECT_EQ(measure({kind, count}).err.find("measure."), std::string::npos) << kind << count;
  expect_refused({"--hottest", "0"}, 2, "--hottest: 0; choose 1 to 100");
  expect_refused({"--hottest", "nan"}, 2, "--hottest");
  expect_refused({"--coldest", "-1"}, 2, "--coldest: -1; choose 1 to 100");
  expect_refused({"--hottest", "1", "--apart", "-1"}, 2, "--apart: -1");
  expect_refused({"--line", "000,32,24", "001,32,24", "--profile", "1"}, 2, "--profile: 1");
  expect_refused({"--pixel", "000,32,24", "--air-c", "-300"}, 2, "--air-c: -300");
  expect_refused({"--pixel", "000,32,24", "--humidity", "900"}, 2, "--humidity: 900");
  expect_refused({"--hottest", "1", "--coldest", "1"}, 2, "together with");
  expect_refused({"--request", "{\"kind\":\"spit\"}"}, 2, "spit");
  expect_refused({"--request", R"({"kind":"spot","kind":"line"})"}, 2, "key \"kind\" twice");
  expect_refused({"--hottest", "1", "--remark", "warm"}, 2, "without --save");
  expect_refused({"--hottest", "1", "--save", "--reference", "joint"}, 2, "none is saved");
  ASSERT_EQ(measure({"--pixel", "000,32,24", "--name", "joint L1", "--save"}).code, 0);
  expect_refused({"--hottest", "1", "--save", "--reference", "joint"}, 2,
                 "'joint', which is not in " + file().string() + "; name one of 'joint L1'");
  expect_refused({"--hottest", "1", "--save", "--name", std::string(300, 'n')}, 2, "300 bytes");
}

TEST_F(Measure, ASessionWithoutRadiometryRefusesAnEmissivityByName) {
  expect_refused({"--pixel", "000,32,24", "--emissivity", "0.6"}, 2, "thermal/000000.tiff");
  EXPECT_THAT(measure({"--pixel", "000,32,24", "--emissivity", "0.6"}).err,
              HasSubstr("--recorded-emissivity"));
  const Outcome told =
      measure({"--pixel", "000,32,24", "--emissivity", "0.6", "--recorded-emissivity", "1"});
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_THAT(told.out, HasSubstr("grey body"));
  // Beside one as recorded, the difference isn't of the two places alone.
  ASSERT_EQ(measure({"--pixel", "000,32,24", "--emissivity", "0.6", "--recorded-emissivity", "1",
                     "--save", "--name", "told"})
                .code,
            0);
  const Outcome both = measure({"--difference", "told", "000,30,24"});
  ASSERT_EQ(both.code, 0) << both.err;
  EXPECT_THAT(both.out, HasSubstr("different object parameters"));
}

TEST_F(Measure, AnotherSessionWithTheSameFileNamesIsRefused) {
  const fs::path moved = *folder / "moved";
  fs::copy(session(), moved, fs::copy_options::recursive);
  const Outcome same = measure({"--pixel", "000,32,24", "--session", moved.string()});
  EXPECT_EQ(same.code, 0) << same.err;
  const fs::path other = *folder / "other";
  FixtureOptions smaller;
  smaller.thermal = 11;
  write_fixture_session(other, smaller);
  expect_refused({"--pixel", "000,32,24", "--session", other.string()}, 3, "was made of");
}

TEST_F(Measure, PosesOfFilesThatTheSessionDoesNotListAreRefused) {
  // As a crafted run would: the model names a file, the session has no frame of that name.
  const fs::path crafted = *folder / "crafted", record = crafted / "poses_thermal/stage.json";
  fs::copy(out(), crafted, fs::copy_options::recursive);
  for (const char* stage : {"poses_thermal", "train_thermal"}) {
    const fs::path model = crafted / stage / "model/images.bin";
    if (!fs::exists(model)) continue;
    std::string bytes = test::get(model);
    const std::size_t at = bytes.find("thermal/000000.tiff");
    ASSERT_NE(at, std::string::npos);
    bytes.replace(at, 19, "thermal/../../x.tif");
    test::put(model, bytes);
  }
  json stage = json::parse(test::get(record));
  stage["inputs"].erase("outside");
  stage.erase("check");
  stage["check"] = content_hash(stage.dump());
  test::put(record, stage.dump());
  const Outcome refused = orbitfuse_program({"measure", crafted.string(), "--hottest", "1"});
  EXPECT_EQ(refused.code, 3) << refused.out << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("thermal/../../x.tif"));
  EXPECT_THAT(refused.err, HasSubstr("no thermal frame of"));
}

TEST_F(Measure, FoldersThatAreNoRunAreNamed) {
  for (const fs::path& wrong : {session(), *folder / "nowhere", fs::path("/dev/null")}) {
    const Outcome refused = orbitfuse_program({"measure", wrong.string(), "--hottest", "1"});
    EXPECT_EQ(refused.code, 3) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(wrong.filename().string()));
  }
}

}  // namespace
}  // namespace orbitfuse
