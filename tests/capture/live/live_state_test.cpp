// SPDX-License-Identifier: BSD-3-Clause
#include "capture/live/live_state.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

namespace orbitfuse {
namespace {

using Json = nlohmann::json;

/// Two loops of four sectors, both cameras on the way, one of them in trouble.
LiveState some_state() {
  LiveState state;
  state.session = "field/car7";
  state.running = true;
  state.elapsed_s = 125;
  state.free_bytes = 3ull << 30;
  StreamStatus visible, thermal;
  visible.device = "visible0";
  visible.received = 300;
  visible.last_id = 299;
  thermal.device = "thermal0";
  thermal.received = 90;
  thermal.missing = 5;
  thermal.rejected = 3;
  thermal.dropped = 2;
  thermal.lost = 10;
  thermal.last_id = 99;
  thermal.silent = true;
  thermal.notice = "a camera like it is at usb:2-1";
  state.streams = {visible, thermal};
  state.rates_hz = {29.97, 0};
  LiveCamera first, second;
  first.instruction = "12° further left, a little higher";
  first.position = OrbitPosition{41.6, 12.4, 0.2, 0};
  second.modality = Modality::thermal;
  second.instruction = "show the mat to the camera";
  state.cameras = {first, second};
  for (int loop = 0; loop < 2; ++loop) {
    for (int i = 0; i < 4; ++i) state.sectors.push_back({loop, i, 90.0 * i, 10 + 20.0 * loop});
  }
  state.sectors[0].best = {{Modality::visible, {"visible/0.jpg"}},
                           {Modality::thermal, {"thermal/0.tiff"}}};
  state.sectors[1].best = {{Modality::visible, {"visible/1.jpg"}}};
  state.sectors[6].best = {{Modality::thermal, {"thermal/1.tiff"}}};
  state.warnings = warnings_of(state);
  return state;
}

/// The terminal and the page are two views of one state: each figure of the page's is in the text.
TEST(LiveState, TerminalShowsWhatThePageShows) {
  const LiveState state = some_state();
  const std::string text = terminal_view(state);
  const Json page = Json::parse(json_of(state));
  const auto shows = [&](const std::string& words) {
    EXPECT_NE(text.find(words), std::string::npos) << words << " is missing in\n" << text;
  };
  shows(page["session"].get<std::string>());
  shows("recording");
  shows("2:05");
  shows("3.0 GiB free");
  for (const Json& s : page["streams"]) {
    shows(s["device"].get<std::string>());
    shows(std::to_string(s["received"].get<int>()) + " received, " +
          std::to_string(s["lost"].get<int>()) + " lost (" +
          std::to_string(s["missing"].get<int>()) + " missing, " +
          std::to_string(s["rejected"].get<int>()) + " rejected, " +
          std::to_string(s["dropped"].get<int>()) + " dropped)");
  }
  shows("30.0 Hz");
  for (const Json& camera : page["cameras"]) shows(camera["instruction"].get<std::string>());
  shows("(at 42, 12 deg)");
  EXPECT_FALSE(page["warnings"].empty());
  for (const Json& warning : page["warnings"]) shows("! " + warning.get<std::string>());
  // One row a loop, one mark a sector.
  ASSERT_EQ(page["loops"].size(), 2u);
  std::istringstream lines(text);
  std::string line;
  std::size_t loop = 0;
  while (std::getline(lines, line)) {
    if (!line.starts_with("loop")) continue;
    std::string marks;
    for (const Json& sector : page["loops"][loop]["sectors"]) {
      const bool visible = sector["visible"], thermal = sector["thermal"];
      marks += visible && thermal ? '#' : visible ? 'v' : thermal ? 't' : '.';
    }
    EXPECT_TRUE(line.ends_with("  " + marks)) << line;
    ++loop;
  }
  EXPECT_EQ(loop, 2u);
  EXPECT_EQ(page["loops"][0]["sectors"].size(), 4u);
}

TEST(LiveState, TroubleIsAWarning) {
  const std::vector<std::string> warnings = warnings_of(some_state());
  ASSERT_EQ(warnings.size(), 5u);
  EXPECT_EQ(warnings[0], "thermal0: no frames");
  EXPECT_EQ(warnings[1], "thermal0: a camera like it is at usb:2-1");
  EXPECT_EQ(warnings[2], "thermal0: the disk is too slow, 2 frames dropped");
  LiveState state = some_state();
  state.streams[1].ended = true;
  EXPECT_EQ(warnings_of(state)[0], "thermal0: the stream has ended");
  state.streams.clear();
  EXPECT_TRUE(warnings_of(state).empty());
  state.free_bytes = 1 << 30;
  EXPECT_EQ(warnings_of(state).size(), 1u);
}

TEST(LiveState, ACameraThatIsAwayIsAnAlarmWithItsSeconds) {
  LiveState state = some_state();
  state.streams[1].away = Absence{8.2, "no frame for a second"};
  const std::vector<std::string> alarms = alarms_of(state);
  ASSERT_EQ(alarms.size(), 1u);
  EXPECT_EQ(alarms[0], "thermal0: disconnected 8 s, reopening");
  const Json page = Json::parse(json_of(state));
  EXPECT_EQ(page["alarms"][0], alarms[0]);
  EXPECT_EQ(page["streams"][1]["away_s"], 8.2);
  EXPECT_TRUE(page["streams"][0]["away_s"].is_null());
  state.running = false;
  EXPECT_TRUE(alarms_of(state).empty());
}

TEST(LiveState, AFullDiskIsNotCalledSlow) {
  LiveState state = some_state();
  state.streams[1].dropped = 0;
  state.streams[1].unwritten = 2;
  const std::string all = Json(warnings_of(state)).dump();
  EXPECT_EQ(all.find("slow"), std::string::npos) << all;
  EXPECT_NE(all.find("2 frames could not be written"), std::string::npos) << all;
  EXPECT_NE(account_words(state.streams[1]).find("2 not written"), std::string::npos);
}

TEST(LiveState, ThePageKnowsTargetsCountsAndRefusals) {
  LiveState state = some_state();
  state.cameras[0].target = OrbitPosition{30, 10, 0, 0};
  state.cameras[0].done = 6;
  state.cameras[0].of = 24;
  state.cameras[0].judged_file = "visible/0.jpg";
  state.cameras[0].refusal = Refusal::blurred;
  const Json camera = Json::parse(json_of(state))["cameras"][0];
  EXPECT_EQ(camera["target"]["azimuth_deg"], 30);
  EXPECT_EQ(camera["done"], 6);
  EXPECT_EQ(camera["of"], 24);
  EXPECT_EQ(camera["refused"], true);
  EXPECT_EQ(camera["refusal"], "blurred, hold still");
  EXPECT_EQ(Json::parse(json_of(state))["streams"][1]["modality"], "visible");
}

TEST(LiveState, OneCameraAloneFillsItsSectors) {
  LiveState state = some_state();
  state.cameras.resize(1);
  EXPECT_NE(terminal_view(state).find("##.."), std::string::npos);
  EXPECT_EQ(terminal_view(LiveState{}).find("loop"), std::string::npos);  // without a guide
}

TEST(LiveState, BeforeTheFirstFrameNothingIsGood) {
  LiveState state = some_state();
  StreamStatus fresh;
  fresh.device = "visible0";
  state.streams[0] = fresh;
  state.cameras[0].latest_file.clear();
  state.cameras[1].latest_file = "thermal/0.tiff";
  Json page = Json::parse(json_of(state));
  EXPECT_EQ(page["cameras"][0]["refusal"], "no frame yet");
  EXPECT_EQ(page["cameras"][1]["refusal"], "no frame judged yet");
  EXPECT_TRUE(page["streams"][0]["first_id"].is_null());
  EXPECT_TRUE(page["streams"][0]["last_id"].is_null());
  EXPECT_EQ(page["streams"][1]["last_id"], 99);
  EXPECT_NE(terminal_view(state).find("visible0   no frame yet"), std::string::npos);
  state.cameras[0].judged_file = "visible/0.jpg";
  EXPECT_EQ(Json::parse(json_of(state))["cameras"][0]["refusal"], "good");
}

TEST(LiveState, FilesPassedOverAreShown) {
  LiveState state = some_state();
  state.streams[0].passed_over = 7;
  state.streams[0].passed_over_last = {"a.heic: not a JPEG", "b.jpg: the same image came before"};
  const Json page = Json::parse(json_of(state));
  EXPECT_EQ(page["streams"][0]["passed_over"], 7);
  EXPECT_EQ(page["streams"][0]["passed_over_last"].size(), 2u);
  EXPECT_NE(terminal_view(state).find(
                "7 passed over, last a.heic: not a JPEG; b.jpg: the same image came before"),
            std::string::npos);
}

}  // namespace
}  // namespace orbitfuse
