// SPDX-License-Identifier: BSD-3-Clause
#include "capture/live/live_state.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <nlohmann/json.hpp>

namespace orbitfuse {
namespace {

using Json = nlohmann::json;
constexpr std::uint64_t little_disk_bytes = 2ull << 30;

Json json_of(const StreamStatus& s, double rate_hz) {
  Json json = account_json(s);
  json["modality"] = name(s.modality);
  json["away_s"] = s.away ? Json(s.away->seconds) : Json();
  json["correction"] = s.correction;
  json["corrections"] = s.corrections;
  json["rejected_last"] = s.rejected_last;
  json["passed_over_last"] = s.passed_over_last;
  json["silent"] = s.silent;
  json["ended"] = s.ended;
  json["rate_hz"] = rate_hz;
  return json;
}

std::string verdict(const LiveCamera& camera) {
  if (!camera.judged_file.empty()) return text(camera.refusal);
  return camera.latest_file.empty() ? "no frame yet" : "no frame judged yet";
}

Json json_of(const LiveCamera& camera) {
  Json json = {{"modality", name(camera.modality)},
               {"instruction", instruction_for(camera, Operator::at_page)},
               {"refusal", verdict(camera)},
               {"refused", !camera.judged_file.empty() && camera.refusal != Refusal::none},
               {"done", camera.done},
               {"of", camera.of},
               {"file", camera.latest_file}};
  if (camera.target)
    json["target"] = {{"azimuth_deg", camera.target->azimuth_deg},
                      {"elevation_deg", camera.target->elevation_deg}};
  if (camera.position) {
    json["position"] = {{"azimuth_deg", camera.position->azimuth_deg},
                        {"elevation_deg", camera.position->elevation_deg},
                        {"sigma_deg", camera.position->sigma_deg}};
  }
  return json;
}

}  // namespace

std::string damaged_words(const StreamStatus& s) {
  std::string words = s.rejected == 1
                          ? "1 frame arrived damaged and counts as lost"
                          : fmt::format("{} frames arrived damaged and count as lost", s.rejected);
  return s.rejected_last.empty() ? words : words + ", last " + s.rejected_last;
}

std::string account_words(const StreamStatus& s) {
  std::string words = fmt::format("{} received, {} lost ({} missing, {} rejected, {} dropped",
                                  s.received, s.lost, s.missing, s.rejected, s.dropped);
  if (s.unwritten > 0) words += fmt::format(", {} not written", s.unwritten);
  words += ")";
  if (s.repeated > 0) words += fmt::format(", {} came again under a settled number", s.repeated);
  return words;
}

Json account_json(const StreamStatus& s) {
  return {{"device", s.device},
          {"received", s.received},
          {"lost", s.lost},
          {"missing", s.missing},
          {"rejected", s.rejected},
          {"dropped", s.dropped},
          {"unwritten", s.unwritten},
          {"repeated", s.repeated},
          {"passed_over", s.passed_over},
          {"first_id", s.any() ? Json(s.first_id) : Json()},
          {"last_id", s.any() ? Json(s.last_id) : Json()}};
}

std::vector<std::string> alarms_of(const LiveState& state) {
  std::vector<std::string> list;
  for (const StreamStatus& s : state.streams) {
    if (!state.running) continue;
    if (s.ended)
      list.push_back(s.device + ": the stream has ended");
    else if (s.away)
      list.push_back(
          fmt::format("{}: disconnected {:.0f} s, reopening", s.device, s.away->seconds));
    else if (s.silent)
      list.push_back(s.device + ": no frames");
  }
  return list;
}

std::vector<std::string> warnings_of(const LiveState& state) {
  std::vector<std::string> list = alarms_of(state);
  for (const StreamStatus& s : state.streams) {
    if (!s.notice.empty()) list.push_back(s.device + ": " + s.notice);
    if (s.dropped > 0)
      list.push_back(
          fmt::format("{}: the disk is too slow, {} frames dropped", s.device, s.dropped));
    if (s.unwritten > 0)
      list.push_back(fmt::format("{}: {} frames could not be written; is the disk full?", s.device,
                                 s.unwritten));
    if (s.missing > 0)
      list.push_back(fmt::format("{}: {} frames lost on the way", s.device, s.missing));
    if (s.rejected > 0) list.push_back(s.device + ": " + damaged_words(s));
  }
  if (state.free_bytes < little_disk_bytes) {
    list.push_back(fmt::format("{:.1f} GiB left on the disk",
                               static_cast<double>(state.free_bytes) / (1ull << 30)));
  }
  return list;
}

std::string json_of(const LiveState& state) {
  Json json = {{"session", state.session},       {"running", state.running},
               {"complete", state.complete},     {"elapsed_s", state.elapsed_s},
               {"free_bytes", state.free_bytes}, {"warnings", state.warnings},
               {"alarms", alarms_of(state)},     {"waits_for_start", state.waits_for_start},
               {"streams", Json::array()},       {"cameras", Json::array()},
               {"loops", Json::array()}};
  for (std::size_t i = 0; i < state.streams.size(); ++i) {
    json["streams"].push_back(
        json_of(state.streams[i], i < state.rates_hz.size() ? state.rates_hz[i] : 0));
  }
  for (const LiveCamera& camera : state.cameras) json["cameras"].push_back(json_of(camera));
  for (const Sector& sector : state.sectors) {
    const auto loop = static_cast<std::size_t>(sector.loop);
    while (json["loops"].size() <= loop)
      json["loops"].push_back(
          {{"elevation_deg", sector.elevation_deg}, {"sectors", Json::array()}});
    json["loops"][loop]["sectors"].push_back({{"azimuth_deg", sector.azimuth_deg},
                                              {"visible", sector.done(Modality::visible)},
                                              {"thermal", sector.done(Modality::thermal)}});
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string terminal_view(const LiveState& state) {
  const auto seconds = static_cast<long>(state.elapsed_s);
  std::string out =
      fmt::format("{}  {}  {}:{:02}  {:.1f} GiB free\n", state.session,
                  state.running           ? "recording"
                  : state.waits_for_start ? "waiting for Start on the page"
                                          : "stopped",
                  seconds / 60, seconds % 60, static_cast<double>(state.free_bytes) / (1ull << 30));
  for (std::size_t i = 0; i < state.streams.size(); ++i) {
    const StreamStatus& s = state.streams[i];
    if (!s.any()) {
      out += fmt::format("{:<10} no frame yet\n", s.device);
      continue;
    }
    out += fmt::format("{:<10} {:5.1f} Hz  {}\n", s.device,
                       i < state.rates_hz.size() ? state.rates_hz[i] : 0.0, account_words(s));
  }
  for (const StreamStatus& s : state.streams) {
    if (s.passed_over > 0)
      out += fmt::format("{:<10} {} passed over, last {}\n", s.device, s.passed_over,
                         fmt::join(s.passed_over_last, "; "));
  }
  std::map<int, std::pair<double, std::string>> loops;
  for (const Sector& sector : state.sectors) {
    auto& [elevation, marks] = loops[sector.loop];
    elevation = sector.elevation_deg;
    const bool visible = sector.done(Modality::visible), thermal = sector.done(Modality::thermal);
    const bool wants_both = state.cameras.size() > 1;
    marks += visible && thermal ? '#'
             : visible          ? (wants_both ? 'v' : '#')
             : thermal          ? (wants_both ? 't' : '#')
                                : '.';
  }
  for (const auto& [loop, row] : loops)
    out += fmt::format("loop {:3.0f} deg  {}\n", row.first, row.second);
  for (const LiveCamera& camera : state.cameras) {
    out += fmt::format("{:<10} {}", name(camera.modality),
                       instruction_for(camera, Operator::at_terminal));
    if (camera.position)
      out += fmt::format("  (at {:.0f}, {:.0f} deg)", camera.position->azimuth_deg,
                         camera.position->elevation_deg);
    out += "\n";
  }
  for (const std::string& warning : state.warnings) out += "! " + warning + "\n";
  return out;
}

}  // namespace orbitfuse
