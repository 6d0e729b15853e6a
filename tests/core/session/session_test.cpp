// SPDX-License-Identifier: BSD-3-Clause
#include "core/session/session.hpp"

#include "core/session/lost_lines.hpp"
#include "core/session/manifest_json.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using test::put;
using test::TempFolder;

FrameRecord full_frame() {
  FrameRecord f;
  f.modality = Modality::thermal;
  f.device = "thermal0";
  f.file = "thermal/000000.tiff";
  f.width = 640;
  f.height = 480;
  f.sequence = 9007199254740992ull;  // 2^53
  f.host_time_ns = 1790000000123456789;
  f.device_time_ns = -5;
  f.station = Station{1, 7, 210.5, 34.25, std::nullopt, 4};
  f.tracking = true;
  f.thermal_is_gray = true;
  f.flags = {"nuc", "of-a-later-version"};
  f.content_hash = "ab";
  f.cam_from_world =
      Rigid3d{Eigen::Quaterniond(0.3, -0.5, 0.2, 0.7).normalized(), {1.0 / 3, -2, 3}};
  f.camera = Camera::from_fov(640, 480, 25);
  f.source = "thermal/x \"quoted\".tiff";
  f.quality = FrameQuality{0.25, 295.5, 0.001, EdgeBlur{1.25, 70}};
  return f;
}

std::string manifest() {
  Session session;
  session.id = "abc";
  session.created = "2026-11-21T00:00:00Z";
  session.notes = {{"operator", "A"}};
  DeviceInfo device{"thermal0", Modality::thermal, "test", "M", "S", {}};
  device.lens.focal_px = 1443.5;
  device.lens.calibrated = Camera::from_fov(640, 480, 25);
  return manifest_header_line(session) + "\n" + manifest_line(device) + "\n" +
         manifest_line(full_frame()) + "\n" +
         manifest_line(GapRecord{"thermal0", full_frame().sequence - 9, 9, "missing"}) + "\n" +
         manifest_line(
             StreamRecord{"thermal0", full_frame().sequence - 9, full_frame().sequence, 1, 9}) +
         "\n" + manifest_line(EventRecord{"thermal0", 77, "nuc", "shutter"}) + "\n" +
         manifest_end_line(session) + "\n";
}

class SessionTest : public ::testing::Test {
 protected:
  SessionTest() { put(folder / "thermal/000000.tiff", "x"); }
  Result<Session> open(const std::string& text) {
    put(folder / "manifest.jsonl", text);
    return open_session(folder.path());
  }
  TempFolder folder;
};

TEST_F(SessionTest, EveryFieldComesBack) {
  const auto s = open(manifest());
  ASSERT_TRUE(s) << s.error().message();
  EXPECT_TRUE(s->complete);
  EXPECT_TRUE(s->warnings.empty());
  EXPECT_EQ(s->notes.at("operator"), "A");
  ASSERT_EQ(s->devices.size(), 1u);
  EXPECT_EQ(s->devices[0].lens.focal_px, 1443.5);
  EXPECT_EQ(s->devices[0].lens.calibrated, Camera::from_fov(640, 480, 25));
  ASSERT_EQ(s->frames.size(), 1u);
  const FrameRecord &f = s->frames[0], e = full_frame();
  EXPECT_EQ(manifest_line(f), manifest_line(e));
  EXPECT_EQ(f.sequence, e.sequence);
  EXPECT_EQ(f.host_time_ns, e.host_time_ns);
  EXPECT_EQ(f.device_time_ns, -5);
  EXPECT_EQ(f.station->azimuth_deg, 210.5);
  EXPECT_FALSE(f.station->azimuth_sigma_deg);
  EXPECT_EQ(f.station->elevation_sigma_deg, 4);
  EXPECT_EQ(f.station->loop, 1);
  EXPECT_TRUE(f.tracking && f.thermal_is_gray && f.has_flag(FrameFlag::nuc) &&
              !f.has_flag(FrameFlag::still) && f.flags.size() == 2);
  EXPECT_EQ(f.camera, e.camera);
  EXPECT_EQ(f.cam_from_world->translation, e.cam_from_world->translation);
  EXPECT_EQ(f.quality->sharpness, 0.25);
  EXPECT_EQ(f.quality->edge_blur->sigma_px, 1.25);
  EXPECT_EQ(f.quality->edge_blur->edges, 70);
  EXPECT_EQ(s->gaps[0].count, 9u);
  EXPECT_EQ(s->streams[0].received + s->streams[0].lost, 10u);
  EXPECT_EQ(s->events[0].kind, "nuc");
  EXPECT_TRUE(s->frames_of(Modality::thermal, false).empty());
  EXPECT_EQ(s->frames_of(Modality::thermal).size(), 1u);
}

TEST_F(SessionTest, LinesThatWereRemovedAreMissed) {
  const std::string text = manifest();
  for (const std::string& line :
       {manifest_line(full_frame()),
        manifest_line(GapRecord{"thermal0", full_frame().sequence - 9, 9, "missing"})}) {
    std::string without = text;
    without.erase(without.find(line), line.size() + 1);
    const auto s = open(without);
    ASSERT_TRUE(s) << s.error().message();
    EXPECT_EQ(s->lost_lines, s->frames.empty() ? 1u : 9u);
    ASSERT_EQ(s->warnings.size(), 1u);
    EXPECT_NE(s->warnings[0].find("in no line of the manifest"), std::string::npos);
  }
}

TEST_F(SessionTest, LinesOfARecordingThatWasCutAreMissedBetweenTheOthers) {
  Session session;
  for (const std::uint64_t id : {4u, 5u, 8u, 9u}) {
    FrameRecord frame;
    frame.device = "visible0";
    frame.sequence = id;
    session.frames.push_back(frame);
  }
  session.gaps.push_back({"visible0", 6, 1, "missing"});
  session.gaps.push_back({"thermal0", 2, 3, "missing"});  // whole
  const auto lost = lost_lines(session);
  ASSERT_EQ(lost.size(), 1u);
  EXPECT_EQ(lost[0].device, "visible0");
  EXPECT_EQ(lost[0].first_sequence, 7u);
  EXPECT_EQ(lost[0].count, 1u);
  session.streams.push_back({"visible0", 1, 12, 12, 0});
  EXPECT_EQ(lost_lines(session)[0].count, 3u + 1 + 3);
  EXPECT_TRUE(lost_lines(Session()).empty());
}

TEST_F(SessionTest, TimesThatNobodyKnowsAreAbsent) {
  FrameRecord undated = full_frame();
  undated.host_time_ns.reset();
  undated.device_time_ns.reset();
  const std::string line = manifest_line(undated), known = manifest_line(full_frame());
  EXPECT_NE(line.find("\"host_time_ns\":0,"), std::string::npos) << "as earlier versions had it";
  std::string text = manifest();
  text.replace(text.find(known), known.size(), line);
  const auto s = open(text);
  ASSERT_TRUE(s) << s.error().message();
  EXPECT_FALSE(s->frames.at(0).host_time_ns);
  EXPECT_FALSE(s->frames.at(0).device_time_ns);
  EXPECT_EQ(manifest_line(s->frames.at(0)), line);
}

TEST_F(SessionTest, CutAnywhereOpensAsIncompleteOrNamesTheLine) {
  const std::string text = manifest();
  const std::size_t header_end = text.find('\n');
  for (std::size_t keep = 0; keep < text.size() - 1; ++keep) {
    const auto s = open(text.substr(0, keep));
    if (keep < header_end) {
      ASSERT_FALSE(s) << keep;
      EXPECT_NE(s.error().message().find("manifest"), std::string::npos);
    } else if (s) {
      const bool all_but_last_newline = keep == text.size() - 1;
      EXPECT_EQ(s->complete, all_but_last_newline) << keep;
      EXPECT_FALSE(s->warnings.empty());
    } else {
      ADD_FAILURE() << "cut at " << keep << ": " << s.error().message();
    }
  }
}

TEST_F(SessionTest, DamageInTheMiddleNamesTheLine) {
  std::string text = manifest();
  text.insert(text.find('\n') + 1, "{\"type\":\"dev\n");
  const auto s = open(text);
  ASSERT_FALSE(s);
  EXPECT_NE(s.error().where.find("manifest.jsonl:2"), std::string::npos) << s.error().where;
}

TEST_F(SessionTest, BlankLinesBehindTheLastAreNoDamage) {
  const std::string text = manifest();
  for (const std::string blank : {"\n", "\n\n\n", "\r\n", " \n\t\r\n", "   "}) {
    const auto s = open(text + blank);
    ASSERT_TRUE(s) << s.error().message();
    EXPECT_TRUE(s->complete);
    EXPECT_EQ(s->frames.size(), 1u);
    EXPECT_TRUE(s->warnings.empty());
  }
  std::string of_windows;
  for (const char c : text) of_windows += c == '\n' ? "\r\n" : std::string(1, c);
  const auto s = open(of_windows + "\r\n\r\n");
  ASSERT_TRUE(s) << s.error().message();
  EXPECT_TRUE(s->complete);
  // Between lines something was cut out; a line that is cut is no blank one.
  std::string hole = text;
  hole.insert(hole.find('\n') + 1, "\n");
  const auto damaged = open(hole);
  ASSERT_FALSE(damaged);
  EXPECT_NE(damaged.error().where.find("manifest.jsonl:2"), std::string::npos);
  const auto cut = open(text + "{\"type\":\"fra\n\n");
  ASSERT_FALSE(cut);
  EXPECT_NE(cut.error().where.find("manifest.jsonl:8"), std::string::npos) << cut.error().where;
  EXPECT_FALSE(open("\n\n"));
}

TEST_F(SessionTest, AKeyThatALineHasTwiceIsNamed) {
  std::string text = manifest();
  text.insert(text.rfind("\"width\":640"), "\"width\":64,");
  const auto session = open(text);
  ASSERT_FALSE(session);
  EXPECT_EQ(session.error().kind, ErrorKind::input);
  EXPECT_NE(session.error().where.find("manifest.jsonl:3"), std::string::npos);
  EXPECT_EQ(session.error().found, "the key \"width\" twice in one object");
  const auto cut = open(text.substr(0, text.find("\n{\"count\"")));  // of a last line too
  ASSERT_FALSE(cut);
  EXPECT_EQ(cut.error().found, session.error().found);
}

TEST_F(SessionTest, FramesThatMayNotBeLookedAtAreNotMissing) {
  if (::geteuid() == 0) GTEST_SKIP() << "root reads everything";
  ASSERT_EQ(::chmod((folder / "thermal").c_str(), 0), 0);
  const auto session = open(manifest());
  ASSERT_EQ(::chmod((folder / "thermal").c_str(), 0700), 0);
  ASSERT_FALSE(session);
  EXPECT_EQ(session.error().where, (folder / "thermal/000000.tiff").string());
  EXPECT_EQ(session.error().found, "Permission denied");
}

TEST_F(SessionTest, FramesThatCannotBeAskedForAreNotMissing) {
  std::filesystem::remove_all(folder / "thermal");
  std::filesystem::create_directory_symlink("thermal", folder / "thermal");
  const auto session = open(manifest());
  ASSERT_FALSE(session);
  EXPECT_EQ(session.error().where, (folder / "thermal/000000.tiff").string());
}

TEST_F(SessionTest, WrongTypesNameTheField) {
  const std::pair<const char*, const char*> edits[] = {
      {"\"width\":640", "\"width\":\"640\""},
      {"\"width\":640", "\"width\":-1"},
      {"\"loop\":1", "\"loop\":1.5"},
      {"\"modality\":\"thermal\",\"q", "\"modality\":\"x\",\"q"},
      {"\"translation\":[", "\"translation\":[null,"},
      {"\"azimuth_deg\":210.5", "\"azimuth_deg\":null"},
      {"\"host_time_ns\":", "\"host_time_ns\":18446744073709551615,\"x\":"},
      {"\"sequence\":9007199254740992", "\"sequence\":18446744073709551615"},
      {"\"sequence\":9007199254740992", "\"sequence\":9007199254740993"},
      {"\"host_time_ns\":", "\"host_time_ns\":-9223372036854775808,\"x\":"}};
  for (const auto& [from, to] : edits) {
    std::string text = manifest();
    // The frame's line; the device's carries a width too.
    const std::size_t frame_at = text.find("\"type\":\"frame\"");
    const std::size_t line = text.rfind('\n', frame_at);
    const std::size_t at = text.find(from, line);
    if (at == std::string::npos) {
      ADD_FAILURE() << from;
      continue;
    }
    text.replace(at, std::string(from).size(), to);
    const auto s = open(text);
    ASSERT_FALSE(s) << to;
    EXPECT_EQ(s.error().kind, ErrorKind::input);
  }
}

TEST_F(SessionTest, CountsThatWouldWrapAreRefused) {
  for (const auto& [from, field] :
       {std::pair{R"("first_sequence":9007199254740983)", "first_sequence"},
        {R"("count":9)", "count"},
        {R"("last_sequence":9007199254740992)", "last_sequence"},
        {R"("received":1)", "received"},
        {R"("lost":9)", "lost"}}) {
    std::string text = manifest();
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, std::string(from).size(),
                 "\"" + std::string(field) + "\":18446744073709551610");
    const auto s = open(text);
    ASSERT_FALSE(s) << field;
    EXPECT_NE(s.error().where.find(field), std::string::npos) << s.error().where;
  }
}

TEST_F(SessionTest, LensesThatFoldAndStationsOfNoOrbitAreRefused) {
  const std::pair<const char*, const char*> edits[] = {
      {"\"k1\":0.0", "\"k1\":-50.0"},
      {"\"azimuth_deg\":210.5", "\"azimuth_deg\":1e300"},
      {"\"elevation_deg\":34.25", "\"elevation_deg\":91"}};
  for (const auto& [from, to] : edits) {
    std::string text = manifest();
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, std::string(from).size(), to);
    EXPECT_FALSE(open(text)) << to;
  }
  // A wide lens bends more than most and is one nevertheless.
  std::string text = manifest();
  text.replace(text.find("\"k1\":0.0"), 8, "\"k1\":-0.3");
  EXPECT_TRUE(open(text));
}

TEST_F(SessionTest, AFrameOfAnotherModalityThanItsDeviceIsNamed) {
  std::string text = manifest();
  const std::string from = "\"modality\":\"thermal\"";
  text.replace(text.find(from, text.find("thermal/000000.tiff")), from.size(),
               "\"modality\":\"visible\"");
  const auto s = open(text);
  ASSERT_FALSE(s);
  EXPECT_NE(s.error().found.find("thermal/000000.tiff is visible"), std::string::npos)
      << s.error().found;
}

TEST_F(SessionTest, PathsThatLeaveTheFolderAreRefused) {
  for (const char* file : {"../secret", "/etc/passwd", "thermal/../../x", ""}) {
    FrameRecord f = full_frame();
    f.file = file;
    std::string text = manifest();
    text.insert(text.find('\n', text.find("\"device\"") == 0 ? 0 : text.find('\n') + 1) + 1,
                manifest_line(f) + "\n");
    EXPECT_FALSE(open(text)) << file;
  }
}

TEST_F(SessionTest, MissingImageIsAWarningAndTheFrameGoes) {
  std::filesystem::remove(folder / "thermal/000000.tiff");
  const auto s = open(manifest());
  ASSERT_TRUE(s);
  EXPECT_TRUE(s->frames.empty());
  ASSERT_EQ(s->warnings.size(), 1u);
  EXPECT_NE(s->warnings[0].find("thermal/000000.tiff"), std::string::npos);
}

TEST_F(SessionTest, ManyMissingImagesAreOneWarning) {
  std::string text = manifest();
  FrameRecord frame = full_frame();
  for (int i = 1; i <= 300; ++i) {
    frame.file = fmt::format("thermal/{:06}.tiff", i);
    frame.sequence -= 1;
    text.insert(text.find("{\"count\""), manifest_line(frame) + "\n");
  }
  const auto s = open(text);
  ASSERT_TRUE(s) << s.error().message();
  EXPECT_EQ(s->frames.size(), 1u);
  ASSERT_EQ(s->warnings.size(), 1u);
  EXPECT_NE(s->warnings[0].find("300 files are listed"), std::string::npos);
  EXPECT_NE(s->warnings[0].find("and 297 more"), std::string::npos) << s->warnings[0];
  EXPECT_EQ(s->missing_files.size(), 300u);
}

TEST_F(SessionTest, UnknownLinesAreSkippedAndNewerFormatsRefused) {
  std::string text = manifest();
  text.insert(text.find('\n') + 1, "{\"type\":\"weather\",\"wind\":3}\n");
  EXPECT_TRUE(open(text));
  text = manifest();
  text.replace(text.find("\"format\":1"), 10, "\"format\":2");
  EXPECT_NE(open(text).error().message().find("update"), std::string::npos);
}

TEST_F(SessionTest, UnknownOriginsOfEarlierVersionsAreUnknown) {
  std::string text = manifest();
  const std::string sigma = "\"elevation_sigma_deg\":4.0";
  ASSERT_NE(text.find(sigma), std::string::npos);
  text.replace(text.find(sigma), sigma.size(), "\"elevation_sigma_deg\":90.0");
  const auto s = open(text);
  ASSERT_TRUE(s) << s.error().message();
  EXPECT_FALSE(s->frames[0].station->elevation_sigma_deg);
  text.replace(text.find("\"elevation_sigma_deg\":90.0"), sigma.size() + 1,
               "\"elevation_sigma_deg\":-5.0");
  EXPECT_FALSE(open(text));
}

TEST_F(SessionTest, ATypeThatIsNoWordIsNamed) {
  for (const char* first : {"{\"type\":0}", "{\"type\":[]}", "{}"})
    EXPECT_EQ(open(std::string(first) + "\n").error().found,
              "the first line is not a session header");
  std::string text = manifest();
  text.insert(text.find('\n') + 1, "{\"type\":7}\n");
  EXPECT_FALSE(open(text));
}

TEST_F(SessionTest, ASecondHeaderIsRefused) {
  const std::string text = manifest();
  const auto s = open(text + text);
  ASSERT_FALSE(s);
  EXPECT_EQ(s.error().found, "a second session header");
}

TEST_F(SessionTest, LaterLineAboutAFileAmendsIt) {
  FrameRecord chosen = full_frame();
  chosen.tracking = false;
  chosen.station = Station{2, 3, 90, 55, 1, 1};
  std::string text = manifest();
  text.insert(text.rfind('\n', text.size() - 2) + 1,
              manifest_line(chosen) + "\n");  // before the end line
  const auto s = open(text);
  ASSERT_TRUE(s) << s.error().message();
  ASSERT_EQ(s->frames.size(), 1u);
  EXPECT_FALSE(s->frames[0].tracking);
  EXPECT_EQ(s->frames[0].station->loop, 2);
  EXPECT_TRUE(s->complete);
}

TEST_F(SessionTest, NoSession) {
  EXPECT_FALSE(open_session(folder / "none"));
  put(folder / "file", "no folder");
  EXPECT_EQ(open_session(folder / "file").error().found, "is a file");
  EXPECT_FALSE(open_session(folder.path()));
  EXPECT_FALSE(open(""));
  EXPECT_FALSE(open("\n"));
}

TEST(Session, ARecordThatWouldNotBeReadIsRefusedBeforeItIsWritten) {
  FrameRecord frame;
  frame.file = "visible/0.jpg";
  frame.device = "visible0";
  EXPECT_TRUE(check_readable(frame));
  frame.cam_from_world = Rigid3d{Eigen::Quaterniond(0, 0, 0, 0), {0, 0, 0}};
  EXPECT_FALSE(check_readable(frame));
  frame.cam_from_world = Rigid3d{Eigen::Quaterniond::Identity(), {std::nan(""), 0, 0}};
  EXPECT_FALSE(check_readable(frame));
  DeviceInfo device;
  device.id = "visible0";
  EXPECT_TRUE(check_readable(device));
  device.lens.focal_px = -4;
  EXPECT_FALSE(check_readable(device));
}

}  // namespace
}  // namespace orbitfuse
