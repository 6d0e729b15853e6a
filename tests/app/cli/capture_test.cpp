// SPDX-License-Identifier: BSD-3-Clause
// Recording from the command line, and what belongs to it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/image/image_io.hpp"
#include "core/session/session.hpp"
#include "core/system/file_io.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
using testing::HasSubstr;

const std::string tiny = "synthetic,size=64x48,spacing=60";

Session opened(const std::filesystem::path& folder) {
  const auto session = open_session(folder);
  EXPECT_TRUE(session) << session.error().message();
  return session ? *session : Session{};
}

TEST(Capture, HelpNamesEveryDriver) {
  const Outcome help = orbitfuse_program({"capture", "--help"});
  EXPECT_EQ(help.code, 0);
  for (const char* driver : {"aravis", "v4l2", "stills", "replay", "synthetic"})
    EXPECT_THAT(help.out, HasSubstr(driver));
}

TEST(Inspect, EachCameraAndSizeIsListed) {
  const test::TempFolder temp;
  std::filesystem::create_directories(temp.path() / "in");
  // Of other contents each: a copy is imported once.
  int green = 80;
  for (const auto& [file, width] : {std::pair{"a.png", 40}, {"b.png", 40}, {"c.png", 64}})
    ASSERT_TRUE(write_png(temp.path() / "in" / file,
                          cv::Mat(30, width, CV_8UC3, cv::Scalar(9, green++, 7))));
  const std::string session = temp.path() / "s";
  const Outcome imported = orbitfuse_program({"import", session, "--visible", temp.path() / "in"});
  ASSERT_EQ(imported.code, 0) << imported.err;
  EXPECT_THAT(imported.err,
              testing::AllOf(HasSubstr("in/a.png"), HasSubstr("in/c.png"), HasSubstr("64x30")));
  const Outcome words = orbitfuse_program({"inspect", session});
  EXPECT_THAT(words.out, testing::AllOf(HasSubstr("visible0: 2 frames of 40x30"),
                                        HasSubstr("visible1: 1 frames of 64x30")));
  const auto visible = orbitfuse_program({"inspect", session, "--json"}).result().at("visible");
  EXPECT_EQ(visible.at("size"), "40x30, 64x30");
  ASSERT_EQ(visible.at("groups").size(), 2u);
  EXPECT_EQ(visible.at("groups")[1].at("size"), "64x30");
  EXPECT_EQ(visible.at("groups")[1].at("frames"), 1);
}

TEST(Capture, TwoCameraSessionReplaysToTheSameFrames) {
  const test::TempFolder temp;
  const std::string first = temp.path() / "first", second = temp.path() / "second";
  const Outcome captured = orbitfuse_program({"capture", first, "--driver", tiny, "--json"});
  ASSERT_EQ(captured.code, 0) << captured.err;
  const auto result = captured.result();
  EXPECT_EQ(result.at("stations").at("visible").at("done"),
            result.at("stations").at("visible").at("of"));
  for (const auto& stream : result.at("streams")) {
    EXPECT_EQ(stream.at("lost"), 0);
    EXPECT_EQ(stream.at("received").get<int>(),
              stream.at("last_id").get<int>() - stream.at("first_id").get<int>() + 1);
  }
  const Outcome replayed = orbitfuse_program({"capture", second, "--driver", "replay:" + first});
  ASSERT_EQ(replayed.code, 0) << replayed.err;
  EXPECT_THAT(replayed.out, HasSubstr("visible0: 12 received, 0 lost"));
  const Session a = opened(first), b = opened(second);
  EXPECT_TRUE(a.complete && b.complete);
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (const FrameRecord& frame : a.frames) {
    const auto same = std::find_if(b.frames.begin(), b.frames.end(), [&](const FrameRecord& f) {
      return f.device == frame.device && f.sequence == frame.sequence;
    });
    ASSERT_NE(same, b.frames.end());
    EXPECT_EQ(same->content_hash, frame.content_hash);
    EXPECT_EQ(same->host_time_ns, frame.host_time_ns);
    EXPECT_EQ(same->station->azimuth_deg, frame.station->azimuth_deg);
  }
  const Outcome inspected = orbitfuse_program({"inspect", second, "--json"});
  EXPECT_EQ(inspected.code, 0);
  EXPECT_EQ(inspected.result().at("visible").at("frames"), 12);
  EXPECT_EQ(inspected.result().at("thermal").at("has_temperatures"), true);
  // The pipeline takes the copy as it takes the original.
  for (const std::string& session : {first, second}) {
    const Outcome planned =
        orbitfuse_program({"run", session, "--out", temp.path() / "out", "--dry-run"});
    EXPECT_EQ(planned.code, 0) << planned.err;
  }
}

TEST(Capture, DryRunWritesNothing) {
  const test::TempFolder temp;
  const Outcome outcome = orbitfuse_program(
      {"capture", temp.path() / "s", "--visible", tiny, "--dry-run", "--seconds", "0.5", "--json"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_GT(outcome.result().at("streams").at(0).at("frames"), 0);
  EXPECT_FALSE(std::filesystem::exists(temp.path() / "s"));
}

TEST(Capture, RefusesAForeignFolderAndResumesASession) {
  const test::TempFolder temp;
  std::ofstream(temp.path() / "holiday.txt") << "x";
  const Outcome foreign = orbitfuse_program({"capture", temp.path(), "--visible", tiny});
  EXPECT_EQ(foreign.code, 3);
  EXPECT_THAT(foreign.err, HasSubstr("choose another folder"));
  EXPECT_EQ(orbitfuse_program({"capture", temp.path(), "--visible", tiny, "--resume"}).code, 3);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(temp.path()), {}), 1);

  const std::string session = temp.path() / "s";
  ASSERT_EQ(orbitfuse_program({"capture", session, "--visible", tiny}).code, 0);
  const Outcome again = orbitfuse_program({"capture", session, "--thermal", tiny});
  EXPECT_EQ(again.code, 3);
  EXPECT_THAT(again.err, HasSubstr("--resume"));
  // The other camera hours later: one after the other into one session.
  ASSERT_EQ(orbitfuse_program({"capture", session, "--thermal", tiny, "--resume"}).code, 0);
  const Session both = opened(session);
  EXPECT_TRUE(both.complete);
  EXPECT_EQ(both.frames_of(Modality::visible).size(), 12u);
  EXPECT_EQ(both.frames_of(Modality::thermal).size(), 12u);
}

TEST(Mat, IsWrittenWholeOrNotAtAll) {
  const test::TempFolder temp;
  const std::string file = temp.path() / "mat.pdf";
  const Outcome outcome =
      orbitfuse_program({"mat", "--out", file, "--size-m", "0.5", "--thermal", "--json"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.result().at("tags_per_side"), 5);
  EXPECT_GT(std::filesystem::file_size(file), 1000u);
  EXPECT_EQ(orbitfuse_program({"mat", "--out", temp.path() / "no.pdf", "--tags", "99"}).code, 2);
  EXPECT_EQ(orbitfuse_program({"mat", "--out", temp.path() / "no.pdf", "--paper", "letter"}).code,
            2);
  EXPECT_FALSE(std::filesystem::exists(temp.path() / "no.pdf"));
}

TEST(Mat, OverwritesAndMakesNothingUnasked) {
  const test::TempFolder temp;
  const std::string file = temp.path() / "mat.pdf", note = temp.path() / "notes.txt";
  std::ofstream(file) << "the operator's";
  std::ofstream(note) << "the operator's";
  std::filesystem::create_directory(temp.path() / "folder.pdf");
  struct Case {
    std::string out;
    int code;
    std::string words;
  };
  const std::vector<Case> cases = {
      {file, 3, "exists already; choose another name, or overwrite it: --force"},
      {note, 2, "end it in .pdf"},
      {temp.path() / "mat", 2, "end it in .pdf"},
      {temp.path() / ".pdf", 2, "end it in .pdf"},
      {temp.path() / "", 2, "end it in .pdf"},
      {temp.path() / "none" / "mat.pdf", 3, "no such folder"},
      {temp.path() / "folder.pdf", 3, "exists and is not a file"},
      {temp.path() / (std::string(300, 'x') + ".pdf"), 2, "choose another name"},
      {"/proc/mat.pdf", 4, "/proc"},
  };
  for (const Case& c : cases) {
    for (const bool dry : {false, true}) {
      std::vector<std::string> words = {"mat", "--out", c.out};
      if (dry) words.emplace_back("--dry-run");
      if (dry && c.out.starts_with("/proc")) continue;  // only the writing tells
      const Outcome outcome = orbitfuse_program(words);
      EXPECT_EQ(outcome.code, c.code) << c.out << outcome.err;
      EXPECT_THAT(outcome.err, HasSubstr(c.words));
    }
  }
  EXPECT_EQ(*read_file(file), "the operator's");
  EXPECT_EQ(*read_file(note), "the operator's");
  EXPECT_FALSE(std::filesystem::exists(temp.path() / "none"));
  EXPECT_EQ(orbitfuse_program({"mat", "--out", file, "--force"}).code, 0);
  EXPECT_THAT(*read_file(file), testing::StartsWith("%PDF"));
  EXPECT_EQ(
      orbitfuse_program({"mat", "--out", "here.PDF", "--tags", "0"}, {.folder = temp.path()}).code,
      2);
  EXPECT_EQ(orbitfuse_program({"mat", "--out", "here.PDF"}, {.folder = temp.path()}).code, 0);
}

TEST(Capture, FilesPassedOverAreNamed) {
  const test::TempFolder temp;
  const auto card = temp.path() / "card";
  std::filesystem::create_directory(card);
  cv::Mat image(30, 40, CV_8UC3);
  cv::randu(image, 0, 255);
  ASSERT_TRUE(write_png(card / "a.png", image));
  std::filesystem::copy(card / "a.png", card / "b.png");
  std::ofstream(card / "c.webp") << "x";
  const std::vector<std::string> words = {"capture",   temp.path() / "s",
                                          "--visible", "stills:" + card.string() + ",existing=yes",
                                          "--seconds", "2.5",
                                          "--guide",   "off"};
  const Outcome outcome = orbitfuse_program(words);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  for (const std::string& text : {outcome.err, outcome.out})
    EXPECT_THAT(text, testing::AllOf(HasSubstr("passed over"), HasSubstr("c.webp: not a JPEG")));
  EXPECT_THAT(outcome.out, testing::AllOf(HasSubstr("visible0: 2 files passed over"),
                                          HasSubstr("b.png: the same image")));
  EXPECT_THAT(outcome.err, HasSubstr("stills, camera known from its first photo"));
}

/// Whoever took it thinks that it is in the session.
TEST(Capture, PhotoThatWasNotWholeAtTheEndIsAccountedFor) {
  const test::TempFolder temp;
  const auto card = temp.path() / "card";
  std::filesystem::create_directory(card);
  ASSERT_TRUE(write_png(card / "a.png", cv::Mat(30, 40, CV_8UC3, cv::Scalar(9, 80, 7))));
  std::ofstream(card / "cut.png", std::ios::binary) << read_file(card / "a.png")->substr(0, 60);
  std::ofstream(card / "zero.png").flush();
  const std::string camera = "stills:" + card.string() + ",existing=yes";
  const Outcome short_one = orbitfuse_program(
      {"capture", temp.path() / "short", "--visible", camera, "--seconds", "0.5"});
  EXPECT_THAT(short_one.out,
              testing::AllOf(HasSubstr("no frame came"), HasSubstr("3 files passed over"),
                             HasSubstr("a.png: not read before the recording ended"),
                             HasSubstr("zero.png: an empty file")));
  const Outcome outcome =
      orbitfuse_program({"capture", temp.path() / "s", "--visible", camera, "--seconds", "2.5"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out,
              HasSubstr("1 received, 1 lost (0 missing, 1 rejected, 0 dropped) of ids 0 to 1"));
  EXPECT_THAT(outcome.out, HasSubstr("1 file passed over, last zero.png"));
  const Session session = opened(temp.path() / "s");
  ASSERT_EQ(session.gaps.size(), 1u);
  EXPECT_THAT(session.gaps[0].reason, HasSubstr("cut.png"));
}

TEST(Capture, NamesThatAreNotUtf8) {
  const test::TempFolder temp;
  const std::string session = temp.path() /
                              "gr\xf6\xdf"
                              "e";
  const Outcome captured = orbitfuse_program({"capture", session, "--visible", tiny, "--json"});
  EXPECT_EQ(captured.code, 0) << captured.err;
  EXPECT_EQ(captured.result().at("ok"), true);
  EXPECT_EQ(orbitfuse_program({"inspect", session, "--json"}).result().at("ok"), true);
  const Outcome run = orbitfuse_program({"run", session, "--out", temp.path() / "out"});
  EXPECT_EQ(run.code, 2) << run.err;
  EXPECT_THAT(run.err, HasSubstr("its name is not UTF-8; rename the folder"));
  const Outcome unknown = orbitfuse_program({"inspect", "\xff", "--json"});
  EXPECT_EQ(unknown.code, 3);
  EXPECT_EQ(unknown.result().at("exit_code"), 3);
}

TEST(Capture, WithoutAFrameTheAccountHasNoIds) {
  const test::TempFolder temp;
  const std::vector<std::string> words = {
      "capture", temp.path() / "s", "--visible", "stills:" + temp.path().string(), "--seconds",
      "0.2",     "--guide",         "off"};
  const Outcome outcome = orbitfuse_program(words);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("visible0: no frame came"));
}

TEST(Capture, WithoutAGuideThereIsNoEnterKey) {
  const test::TempFolder temp;
  const auto words = [&](const char* guide) {
    return orbitfuse_program({"capture", temp / guide, "--visible",
                              "stills:" + temp.path().string(), "--seconds", "0.2", "--guide",
                              guide})
        .err;
  };
  EXPECT_THAT(words("off"), testing::Not(HasSubstr("Enter")));
  EXPECT_THAT(words("key"), HasSubstr("Enter: at the next station"));
}

TEST(Devices, AnswersWithAList) {
  const Outcome outcome = orbitfuse_program({"devices", "--json"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(outcome.result().at("devices").is_array());
}

TEST(Capture, MistakesHaveARemedyAndLeaveNothing) {
  const test::TempFolder temp;
  const std::string session = temp.path() / "s";
  struct Case {
    std::vector<std::string> cameras;
    int code;
    std::string words;
  };
  const std::vector<Case> cases = {
      {{}, 2, "--visible"},
      {{"--visible", "webcam"}, 2, "use one of aravis"},
      {{"--visible", "v4l2:/dev/video97"}, 4, "plug it in"},
      {{"--thermal", "aravis:nobody-0815"}, 4, "subnet"},
      {{"--thermal", "aravis,profile=nonsense"}, 2, "flir-ax5"},
      {{"--driver", "replay:/nowhere"}, 3, "no such folder"},
      {{"--driver", tiny, "--spacing-deg", "31"}, 2, "guide.spacing_deg"},
      {{"--driver", tiny, "--turntable", "500"}, 2, "--turntable: 500"},
      {{"--driver", tiny, "--turntable", "0"},
       2,
       "--turntable: 0; give the table's step, -120 to 120 and not 0"},
      {{"--driver", tiny, "--turntable", "15"}, 2, "don't wait for a key"},
      {{"--driver", tiny, "--spacing-deg", "0"}, 2, "--spacing-deg: 0; give 1 to 120"},
      {{"--driver", tiny, "--seconds", "-1"},
       2,
       "--seconds: -1; give 0 (until it is stopped) to 10000000"},
      {{"--driver", tiny, "--seconds", "nan"}, 2, "--seconds: nan"},
      {{"--driver", tiny, "--max-edge-px", "0", "3"}, 2, "--max-edge-px: 0; give more than 0"},
      {{"--driver", tiny, "--elevations-deg", "10", "12"}, 2, "degrees apart or more"},
      {{"--driver", tiny, "--elevations-deg", "100"}, 2, "--elevations-deg: 100"},
      {{"--driver", tiny, "--mat-tags", "7"}, 2, "the frames carry their stations"},
      {{"--driver", tiny, "--mat", "foil"}, 2, "--mat: no mat is looked for"},
      {{"--visible", "stills:.", "--guide", "key", "--mat-tags", "7"},
       2,
       "use --guide auto without --turntable"},
      {{"--visible", "stills:.", "--mat-tags", "0"}, 2, "--mat-tags: 0; choose 2 to 15"},
      {{"--driver", tiny, "--guide", "key"},
       2,
       "--guide key: replayed and synthetic frames don't wait for a key"},
      {{"--driver", tiny, "--guide", "off", "--spacing-deg", "60"},
       2,
       "--spacing-deg: given with --guide off"},
      {{"--driver", tiny, "--visible", tiny, "--thermal", tiny},
       2,
       "leave it out: --visible and --thermal"},
      {{"--visible", "", "--thermal", tiny}, 2, "--visible: given without a name"},
      {{"--visible", tiny, "--page", ""}, 2, "--page: given without a name"},
      {{"--visible", "stills:.,existing=yes,existing=no"}, 2, "existing is given twice"},
      {{"--driver", tiny, "--token", "12345678"}, 2, "--token: given without --page"},
  };
  for (const Case& c : cases) {
    std::vector<std::string> arguments = {"capture", session};
    arguments.insert(arguments.end(), c.cameras.begin(), c.cameras.end());
    const Outcome outcome = orbitfuse_program(arguments);
    EXPECT_EQ(outcome.code, c.code) << c.words << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(c.words));
    EXPECT_FALSE(std::filesystem::exists(session)) << c.words;
  }
}

}  // namespace
}  // namespace orbitfuse
