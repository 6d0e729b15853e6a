// SPDX-License-Identifier: BSD-3-Clause
// Odd words and files on the command line: the program says what it makes of them, and never writes
// over what it was given.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/resource.h>

#include <fstream>
#include <regex>
#include <set>

#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/app/cli/session_fixture.hpp"
#include "tests/support/made_files.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Hostile : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return temp.path() / name; }
  void put_pair() const {
    cv::Mat visible(48, 64, CV_8UC3), thermal(48, 64, CV_8UC1);
    cv::randu(visible, 0, 255);
    cv::randu(thermal, 0, 255);
    ASSERT_TRUE(write_png(path("v.png"), visible));
    ASSERT_TRUE(write_png(path("t.png"), thermal));
  }
  Outcome fuse(std::vector<std::string> more) const {
    more.insert(more.begin(), {"fuse", "--visible", path("v.png"), "--thermal", path("t.png")});
    return orbitfuse_program(more, {.folder = temp.path()});
  }
  void refused(const Outcome& outcome, int code, const std::string& words) const {
    EXPECT_EQ(outcome.code, code) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(words));
  }
  const test::TempFolder temp;
};

TEST_F(Hostile, ImagesWithoutAnExtensionAreNamed) {
  put_pair();
  fs::create_directory(path("photos"));
  fs::copy_file(path("v.png"), path("photos/a.png"));
  cv::Mat other(48, 64, CV_8UC3);
  cv::randu(other, 0, 200);
  ASSERT_TRUE(write_png(path("b.png"), other));
  fs::rename(path("b.png"), path("photos/b"));
  std::ofstream(path("photos/README")) << "of no interest";
  const Outcome outcome = orbitfuse_program({"import", path("s"), "--visible", path("photos")},
                                            {.folder = temp.path()});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.err + outcome.out,
              HasSubstr("photos/b: an image whose name has no extension"));
  EXPECT_THAT(outcome.err + outcome.out, Not(HasSubstr("README")));

  fs::remove(path("photos/a.png"));
  refused(orbitfuse_program({"import", path("none"), "--visible", path("photos")},
                            {.folder = temp.path()}),
          3, "1 images whose names have no extension (b); rename them");
}

TEST_F(Hostile, AFileThatOutgrowsItsLimitIsTold) {
  put_pair();
  fs::create_directory(path("photos"));
  fs::copy_file(path("v.png"), path("photos/a.png"));
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{4096, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const Outcome outcome = orbitfuse_program({"import", path("s"), "--visible", path("photos")},
                                            {.folder = temp.path()});
  setrlimit(RLIMIT_FSIZE, &before);
  refused(outcome, 4, "000000.png");
  EXPECT_FALSE(fs::exists(path("s/visible/000000.png")));
}

TEST_F(Hostile, FuseWritesWhereItIsToldAndNowhereElse) {
  put_pair();
  const std::string visible = *read_file(path("v.png"));
  refused(fuse({}), 2, "--out: not given");
  EXPECT_FALSE(fs::exists(path("out")));
  refused(fuse({"--out", path("v.png")}), 2, "is an input too");
  refused(fuse({"--out", path("./") + "v.png"}), 2, "is an input too");
  EXPECT_EQ(*read_file(path("v.png")), visible);
  refused(fuse({"--out", path("f.gif")}), 2, "end it in .png or .jpg");
  EXPECT_EQ(fuse({"--out", path("f.png"), "--dry-run"}).code, 0);
  EXPECT_FALSE(fs::exists(path("f.png")));
  for (const auto& [name, format] : {std::pair{"f.png", ImageFormat::png},
                                     {"f.jpg", ImageFormat::jpeg},
                                     {"f.JPEG", ImageFormat::jpeg}}) {
    const Outcome done = fuse({"--out", path(name)});
    EXPECT_EQ(done.code, 0) << done.err;
    EXPECT_EQ(image_format(*read_file(path(name))), format) << name;
  }
}

TEST_F(Hostile, OddPairsAreNamedByTheirFiles) {
  put_pair();
  ASSERT_TRUE(write_png(path("dot.png"), cv::Mat(1, 1, CV_8UC3, cv::Scalar::all(9))));
  ASSERT_TRUE(write_png(path("none.png"), cv::Mat(48, 64, CV_16UC1, cv::Scalar(0))));
  std::ofstream(path("empty.png")).close();
  fs::create_directory(path("folder"));
  const auto pair = [&](const std::string& verb, const std::string& visible,
                        const std::string& thermal, std::vector<std::string> more) {
    more.insert(more.begin(), {verb, "--visible", path(visible), "--thermal", path(thermal)});
    return orbitfuse_program(more, {.folder = temp.path()});
  };
  const std::vector<std::string> out = {"--out", path("f.png")}, fused = {"--fused", path("v.png")};
  for (const auto& [verb, more] : {std::pair{"fuse", out}, {"metrics", fused}}) {
    refused(pair(verb, "v.png", "v.png", more), 2, path("v.png") + ": is --visible too");
    refused(pair(verb, "v.png", "dot.png", more), 3, path("dot.png") + ": 1x1");
    refused(pair(verb, "v.png", "none.png", more), 3, path("none.png") + ": no finite sample");
    refused(pair(verb, "v.png", "empty.png", more), 3, path("empty.png") + ": empty file");
    refused(pair(verb, "v.png", "folder", more), 3, path("folder"));
    refused(pair(verb, "folder", "t.png", more), 3, "folder");
  }
  refused(pair("fuse", "v.png", "t.png", {"--mask", path("v.png"), "--out", path("f.png")}), 3,
          path("v.png") + ": 64x48, 3 channels of 8 bits; must be 64x48, 8-bit gray");
  EXPECT_FALSE(fs::exists(path("f.png")));
  EXPECT_EQ(fuse({"--out", path("f.png"), "--method", "heat"}).code, 0);
}

TEST_F(Hostile, FuseAndMetricsNameImagesWithTransparentPixels) {
  put_pair();
  cv::Mat clear(48, 64, CV_8UC4, cv::Scalar(10, 200, 90, 255));
  for (const auto& [name, alpha] : {std::pair("opaque.png", 255), std::pair("clear.png", 0)}) {
    clear.at<cv::Vec4b>(5, 6)[3] = static_cast<std::uint8_t>(alpha);
    ASSERT_TRUE(write_png(path(name), clear));
    for (const auto& more : {std::vector<std::string>{"fuse", "--out", path("f.png")},
                             std::vector<std::string>{"metrics", "--fused", path("v.png")}}) {
      std::vector<std::string> words = more;
      words.insert(words.end(), {"--visible", path(name), "--thermal", path("t.png")});
      const Outcome outcome = orbitfuse_program(words);
      EXPECT_EQ(outcome.code, 0) << outcome.err;
      EXPECT_EQ(outcome.err.find("clear.png: 0.0326 % of its pixels are transparent") !=
                    std::string::npos,
                alpha == 0)
          << outcome.err;
    }
  }
}

/// A preview that no tag calls so, or what is meant.
TEST_F(Hostile, FuseAndMetricsNamePagesThatTheyLeaveOut) {
  put_pair();
  cv::Mat large(48, 64, CV_8UC1), small(24, 32, CV_8UC1);
  cv::randu(large, 0, 255);
  cv::randu(small, 0, 255);
  ASSERT_TRUE(write_file_atomic(path("p.tif"), made::tiff_of_pages({large, small})));
  for (const auto& more : {std::vector<std::string>{"fuse", "--out", path("f.png")},
                           std::vector<std::string>{"metrics", "--fused", path("v.png")}}) {
    std::vector<std::string> words = more;
    words.insert(words.end(), {"--visible", path("v.png"), "--thermal", path("p.tif")});
    const Outcome outcome = orbitfuse_program(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("p.tif: page 2 (32x24, 8-bit)"));
  }
}

TEST_F(Hostile, TheLegendOfFuseIsNotWrittenOntoAnInput) {
  put_pair();
  fs::copy_file(path("t.png"), path("f_legend.png"));
  const std::string before = *read_file(path("f_legend.png"));
  const auto fuse_onto = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"fuse", "--visible", path("v.png"), "--thermal",
                               path("f_legend.png"), "--out", path("f.png")});
    return orbitfuse_program(more);
  };
  refused(fuse_onto({}), 2, "its legend would be written onto the input " + path("f_legend.png"));
  EXPECT_EQ(*read_file(path("f_legend.png")), before);
  EXPECT_EQ(fuse_onto({"--method", "ms-srif"}).code, 0) << "which has no legend";
  fs::create_directory(path("g_legend.png"));
  refused(fuse({"--out", path("g.png")}), 3, "g_legend.png");
  EXPECT_FALSE(fs::exists(path("g.png"))) << "seen before the picture is written";
}

TEST_F(Hostile, ADryRunOfDevicesEndsByItself) {
  const Outcome dry = run_program(
      {"timeout", "20", ORBITFUSE_BINARY_DIR "/app/orbitfuse", "devices", "--watch", "--dry-run"});
  EXPECT_EQ(dry.code, 0) << dry.err;
  EXPECT_NE(dry.err.find("would go on"), std::string::npos) << dry.err;
}

TEST_F(Hostile, AnExchangedPairIsNamed) {
  put_pair();
  ASSERT_TRUE(write_png(path("kelvin.png"), cv::Mat(48, 64, CV_16UC1, cv::Scalar(29500))));
  for (const auto& more : {std::vector<std::string>{"fuse", "--out", path("f.png")},
                           std::vector<std::string>{"metrics", "--fused", path("v.png")}}) {
    std::vector<std::string> words = more;
    words.insert(words.end(), {"--visible", path("kelvin.png"), "--thermal", path("v.png")});
    const Outcome told = orbitfuse_program(words);
    EXPECT_EQ(told.code, 0) << told.err;
    EXPECT_NE(told.err.find(path("kelvin.png") + ": 16-bit grey as the visible image"),
              std::string::npos)
        << told.err;
  }
}

/// What a library calls it stands in no help.
TEST_F(Hostile, OptionsOutOfRangeAreNamedAsTheyWereTyped) {
  put_pair();
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{"mat", "--out", path("m.pdf"), "--size-m", "0"}, "--size-m: 0; choose 0.05 to 20"},
      {{"mat", "--out", path("m.pdf"), "--tags", "99"}, "--tags: 99"},
      {{"mat", "--out", path("m.pdf"), "--paper", "A0"}, "--paper: A0"},
      {{"view", "run", "--page", "99999"}, "--page: 99999"},
      {{"view", "run", "--token", "short"}, "--token: shorter"},
      {{"compare", "a", "b", "--out", path("c"), "--triangles", "3"}, "--triangles: 3; choose 4"},
      {{"render", "s", "--views", "0"}, "--views: 0; choose 1"},
      {{"render", "s", "--width", "1"}, "--width: 1; choose 16"},
      {{"register", "s", "--seed", "4294967296"},
       "--seed: '4294967296' is no whole number from 0 to 2^32 - 1"},
      {{"train", "s", "--seed", "-1"}, "--seed: '-1' is no whole number"},
      {{"train", "s", "--target-psnr", "nan"}, "--target-psnr: 'nan' is no number"}};
  for (const auto& [words, said] : cases) {
    refused(orbitfuse_program(words), 2, said);
    std::vector<std::string> dry = words;
    dry.emplace_back("--dry-run");
    refused(orbitfuse_program(dry), 2, said);
  }
  // Read before the training that it would be found after.
  std::ofstream(path("cameras.json")) << "{}";
  write_fixture_session(path("s"));
  refused(orbitfuse_program({"render", path("s"), "--out", path("o"), "--cameras",
                             path("cameras.json"), "--dry-run"}),
          3, "cameras.json");
}

/// Results among the images of a session would be images of it.
TEST_F(Hostile, FarmsAndReplaysDoNotWriteAmongTheFramesOfTheirSession) {
  write_fixture_session(path("s"));
  for (const std::string& out : {path("s"), path("s/visible"), path("s/visible/farm")})
    refused(orbitfuse_program({"farm", path("s"), "--out", out, "--dry-run"}), 2,
            "--out " + out + ": holds the session itself");
  refused(orbitfuse_program({"replay", path("s"), "--to", path("s/visible/copy")}), 2,
          "--to " + path("s/visible/copy") + ": lies among the frames");
  EXPECT_FALSE(fs::exists(path("s/visible/copy")));
}

TEST_F(Hostile, NamesThatAreTooLongForTheDiskAreNamed) {
  put_pair();
  write_fixture_session(path("s"));
  const std::string name(300, 'n');
  refused(orbitfuse_program({"measure", name}), 3, name);
  refused(orbitfuse_program(
              {"fuse", "--visible", name, "--thermal", path("t.png"), "--out", path("f.png")}),
          3, name);
  std::ofstream(path("truth.json")) << R"({"visible": {"K": {"w": 64, "h": 48, "fx": 60, "fy": 60,
      "cx": 32, "cy": 24}, "frames": [{"file": "a.jpg", "c2w": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]}})";
  refused(
      orbitfuse_program({"eval", path("s"), "--out", name, "--ground-truth", path("truth.json")}),
      3, name);
}

TEST_F(Hostile, CloudsThatNothingCanBeMadeOfAreNamed) {
  const auto cloud = [&](const std::string& name, const std::string& point) {
    std::string text =
        "ply\nformat ascii 1.0\nelement vertex 30\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n";
    for (int i = 0; i < 30; ++i) text += point;
    std::ofstream(path(name)) << text;
    return path(name);
  };
  const std::string nan = cloud("nan.ply", "nan nan nan\n"), one = cloud("one.ply", "1 2 3\n");
  const Outcome outcome = orbitfuse_program({"register", "--source", nan, "--target", one});
  refused(outcome, 3, nan + ": 0 finite points");
  EXPECT_THAT(outcome.err, HasSubstr(nan + ": 30 of 30 points have no position"));
  refused(orbitfuse_program({"register", "--source", one, "--target", nan}), 3, one);
}

TEST_F(Hostile, FoldersOfPairsAreNotWrittenOver) {
  put_pair();
  for (const char* part : {"vi", "ir"}) fs::create_directories(path("pairs") + "/" + part);
  fs::copy_file(path("v.png"), path("pairs/vi/a.png"));
  fs::copy_file(path("t.png"), path("pairs/ir/a.png"));
  const auto run = [&](std::vector<std::string> more) {
    more.insert(more.begin(),
                {"fuse", "--visible", path("pairs/vi"), "--thermal", path("pairs/ir")});
    return orbitfuse_program(more, {.folder = temp.path()});
  };
  refused(run({}), 2, "--out: not given");
  refused(run({"--out", path("pairs")}), 2, "would write into the input");
  EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(Hostile, EmptyValuesAreNoValues) {
  write_fixture_session(path("s"));
  for (const char* option : {"--budget", "--config", "--out", "--cameras"})
    refused(orbitfuse_program({"run", path("s"), option, ""}, {.folder = temp.path()}), 2,
            std::string(option) + ": empty");
  refused(orbitfuse_program({"inspect", ""}), 2, "empty");
}

TEST_F(Hostile, NumbersAreNamedAsTheyWereTyped) {
  put_pair();
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{"--humidity", "900"}, "--humidity: 900; choose 1 to 100"},
      {{"--humidity", "0.5"}, "--humidity: 0.5; choose 1 to 100"},
      {{"--reflected-c", "-300"}, "--reflected-c: -300"},
      {{"--emissivity", "1.5"}, "--emissivity: 1.5"},
      {{"--station-spacing-deg", "0"}, "--station-spacing-deg: 0; choose 1 to 180"},
      {{"--station-spacing-deg", "15", "--loops", "0"}, "--loops: 0; choose 1 to 100"},
      {{"--station-spacing-deg", "15", "--loops", "2", "--elevations-deg", "10"},
       "--elevations-deg: 1 given, for 2 loops"},
      {{"--thermal-scale", "linear", "--kelvin-per-count", "0"}, "--kelvin-per-count: 0;"},
      {{"--thermal-scale", "linear"}, "--kelvin-per-count"},
      {{"--emissivity", "0.9"}, "no radiometric JPEGs"}};
  for (const auto& [options, words] : cases) {
    std::vector<std::string> line{"import", path("s"), "--thermal", path("t.png")};
    line.insert(line.end(), options.begin(), options.end());
    refused(orbitfuse_program(line), 2, words);
    EXPECT_FALSE(fs::exists(path("s")));
  }
}

TEST_F(Hostile, OutputThatNobodyGetsIsNoSuccess) {
  write_fixture_session(path("s"));
  const std::string program = ORBITFUSE_BINARY_DIR "/app/orbitfuse";
  const auto shell = [&](const std::string& line) { return run_program({"sh", "-c", line}); };
  refused(shell(program + " inspect " + path("s") + " > /dev/full"), 4, "standard output");
  refused(shell(program + " inspect " + path("s") + " --json > /dev/full"), 4, "standard output");
  EXPECT_EQ(shell(program + " --help > /dev/full").code, 4);
  // Who stops reading has what he wanted.
  EXPECT_EQ(shell("{ " + program + " inspect " + path("s") + "; echo $? >&2; } | true").err, "0\n");
  const std::string dry_run = program + " run " + path("s") + " --dry-run --out " + path("o");
  const int code = shell(dry_run).code;
  shell("{ sleep 0.2; " + dry_run + " 2>&1; echo $? > " + path("code") + "; } | true");
  EXPECT_EQ(shell("cat " + path("code")).out, std::to_string(code) + "\n");
}

TEST_F(Hostile, NamesDoNotReachTheTerminalAsCommands) {
  const std::string name = path("a\x1b[2J\x07.jpg");
  std::ofstream(name) << "no image";
  const Outcome outcome = orbitfuse_program({"import", path("s"), "--visible", name});
  EXPECT_EQ(outcome.code, 3);
  EXPECT_THAT(outcome.err, AllOf(Not(HasSubstr("\x1b")), Not(HasSubstr("\x07")),
                                 HasSubstr("a\\x1b[2J\\x07.jpg")));
  const Outcome word = orbitfuse_program({"insp\x1b[31mect"});
  EXPECT_THAT(word.err, Not(HasSubstr("\x1b")));
}

TEST_F(Hostile, InspectLooksAtTheFrames) {
  write_fixture_session(path("s"));
  EXPECT_EQ(orbitfuse_program({"inspect", path("s")}).code, 0);
  fs::resize_file(path("s/visible/000003.png"), 100);
  fs::resize_file(path("s/thermal/000001.tiff"), 90);
  const Outcome outcome = orbitfuse_program({"inspect", path("s"), "--json"});
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.result().at("damaged").size(), 2u);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("visible/000003.png"), HasSubstr("thermal/000001.tiff"),
                                 HasSubstr("2 of 24")));
}

TEST_F(Hostile, InspectMissesFramesThatAreGone) {
  write_fixture_session(path("s"));
  fs::remove(path("s/thermal/000001.tiff"));
  const Outcome outcome = orbitfuse_program({"inspect", path("s"), "--json"});
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.result().at("missing"), nlohmann::json({"thermal/000001.tiff"}));
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("1 of 24 frames are missing"), HasSubstr("copy them")));
}

TEST_F(Hostile, InspectMissesLinesThatAreGone) {
  write_fixture_session(path("s"));
  std::string text = *read_file(path("s/manifest.jsonl"));
  const std::size_t named = text.find("thermal/000001.tiff"), begin = text.rfind('\n', named) + 1;
  text.erase(begin, text.find('\n', named) + 1 - begin);
  test::put(path("s/manifest.jsonl"), text);
  const Outcome outcome = orbitfuse_program({"inspect", path("s"), "--json"});
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.result().at("lost_lines"), 1);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("1 of its frames is in no line of the manifest"),
                                 HasSubstr("restore the manifest")));
}

TEST_F(Hostile, ExchangedFramesAreToldAndEditedOnesNamed) {
  write_fixture_session(path("s"));
  fs::rename(path("s/visible/000003.png"), path("kept"));
  fs::rename(path("s/visible/000007.png"), path("s/visible/000003.png"));
  fs::rename(path("kept"), path("s/visible/000007.png"));
  cv::Mat edited = *read_visible(path("s/visible/000001.png"));
  edited.at<cv::Vec3b>(3, 3) = {1, 2, 3};
  ASSERT_TRUE(write_png(path("s/visible/000001.png"), edited));
  const Outcome outcome = orbitfuse_program({"inspect", path("s"), "--json"});
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.result().at("damaged").size(), 2u);
  EXPECT_EQ(outcome.result().at("changed"), nlohmann::json({"visible/000001.png"}));
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("holds what was recorded as visible/000007.png"),
                                 HasSubstr("holds what was recorded as visible/000003.png"),
                                 HasSubstr("visible/000001.png: changed since")));
  refused(orbitfuse_program({"poses", path("s"), "--out", path("o")}), 3,
          "holds what was recorded");
}

TEST_F(Hostile, ADamagedRunJsonIsToldByInspect) {
  write_fixture_session(path("s"), {.thermal = few_thermal});
  ASSERT_EQ(orbitfuse_program({"poses", path("s"), "--out", path("o")}).code, 0);
  EXPECT_EQ(orbitfuse_program({"inspect", path("o")}).code, 0);
  std::ofstream(path("o/run.json")) << "{\"cut";
  refused(orbitfuse_program({"inspect", path("o")}), 3, "run.json");
}

TEST_F(Hostile, ReportTellsWhatIsThereAndMakesNothing) {
  write_fixture_session(path("s"), {.thermal = few_thermal});
  const auto report = [&] { return orbitfuse_program({"report", path("s"), "--out", path("o")}); };
  refused(report(), 3, "no finished stage");
  EXPECT_FALSE(fs::exists(path("o/run.json")));
  ASSERT_EQ(orbitfuse_program({"poses", path("s"), "--out", path("o")}).code, 0);
  const Outcome outcome = report();
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(fs::exists(path("o/report/report.html")));
  EXPECT_FALSE(fs::exists(path("o/train_visible")));
  EXPECT_FALSE(fs::exists(path("o/depth")));
  EXPECT_THAT(outcome.err, HasSubstr("it has not run yet"));
}

TEST_F(Hostile, WhyColmapFailedIsInTheMessage) {
  write_fixture_session(path("s"), {.known_poses = false});
  std::ofstream(path("boom.sh")) << "#!/bin/sh\necho 'boom: no GPU' >&2\nexit 3\n";
  fs::permissions(path("boom.sh"), fs::perms::owner_all);
  const Outcome outcome = orbitfuse_program(
      {"poses", path("s"), "--out", path("o"), "--set", "poses.colmap=" + path("boom.sh")});
  EXPECT_NE(outcome.code, 0);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("boom: no GPU"), Not(HasSubstr("colmap.log"))));
}

TEST_F(Hostile, TextOfManyLevelsIsRefused) {
  const std::string deep = std::string(200'000, '[') + std::string(200'000, ']');
  std::string key = "a";
  for (int i = 0; i < 50'000; ++i) key += ".a";
  const auto put = [&](const char* name, const std::string& text) {
    std::ofstream(path(name), std::ios::binary) << text;
    return path(name);
  };
  const std::string session = path("session");
  write_fixture_session(session);
  for (const std::string& text : {key + " = 1", "[" + key + "]\nb = 1", "a = {" + key + " = 1}"})
    refused(orbitfuse_program({"run", session, "--config", put("c.toml", text), "--print-config"}),
            3, "c.toml:1: a key of more than 100 parts");
  refused(
      orbitfuse_program({"run", session, "--set", "render.views=" + deep.substr(150'000, 100'000)}),
      2, "render.views");
  const std::string photo = path("v.png");
  put_pair();
  refused(
      orbitfuse_program(
          {"import", path("new"), "--visible", photo, "--transforms",
           put("t.json", R"({"frames":[{"file_path":"v.png","transform_matrix":)" + deep + "}]}")}),
      3, "t.json: lists within lists");
  std::ofstream(session + "/manifest.jsonl", std::ios::app | std::ios::binary)
      << "{\"type\":\"frame\",\"file\":" << deep << "}\n";
  refused(orbitfuse_program({"inspect", session}), 3, "not a JSON object");
}

TEST_F(Hostile, RunsDoNotWriteAmongTheFramesOfTheirSession) {
  const std::string session = path("session");
  write_fixture_session(session);
  for (const char* out : {"", "/visible", "/thermal/x", "/../session"})
    refused(orbitfuse_program({"run", session, "--out", session + out}), 2, "holds the session");
  EXPECT_FALSE(fs::exists(session + "/run.json"));
  EXPECT_FALSE(fs::exists(session + "/thermal/x"));
}

TEST_F(Hostile, ConfigurationsThatNeverEndAreRefused) {
  write_fixture_session(path("s"));
  refused(orbitfuse_program({"run", path("s"), "--out", path("o"), "--config", "/dev/zero"}), 3,
          "a device, not a file");
  refused(orbitfuse_program({"register", "--source", "/dev/zero", "--target", "/dev/zero"}), 3,
          "a device, not a file");
  std::ofstream(path("huge.toml")).close();
  fs::resize_file(path("huge.toml"), 8ull << 30);
  refused(orbitfuse_program({"run", path("s"), "--out", path("o"), "--config", path("huge.toml")}),
          3, "8192 MiB");
}

/// Options named in messages are options of the program.
TEST(Messages, NameOptionsThatExist) {
  const std::string reference = *read_file(fs::path(ORBITFUSE_SOURCE_DIR) / "docs/cli.md");
  // Of other programs that are told to run: v4l2-ctl, COLMAP, Chromium, apt-get, Slurm's, and our
  // recorder of scenes.
  const std::set<std::string> of_others = {"record_main.cpp", "colmap.cpp", "print_pdf.cpp",
                                           "slurm.cpp", "slurm_farm.cpp"};
  const std::regex literal(R"lit("((?:[^"\\]|\\.)*)")lit"),
      option(R"((^|[^\w-])(--[a-z][a-z0-9-]*[a-z0-9]))");
  for (const char* folder : {"app", "core", "capture", "drivers", "fusion", "recon"}) {
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::path(ORBITFUSE_SOURCE_DIR) / folder)) {
      if (entry.path().extension() != ".cpp" || of_others.contains(entry.path().filename()))
        continue;
      std::istringstream lines(*read_file(entry.path()));
      for (std::string line; std::getline(lines, line);) {
        if (line.find("v4l2-ctl") != std::string::npos) continue;
        for (std::sregex_iterator text(line.begin(), line.end(), literal), end; text != end;
             ++text) {
          const std::string words = (*text)[1];
          for (std::sregex_iterator o(words.begin(), words.end(), option); o != end; ++o)
            EXPECT_THAT(reference, HasSubstr((*o)[2].str())) << entry.path() << ": " << line;
        }
      }
    }
  }
}

}  // namespace
}  // namespace orbitfuse
