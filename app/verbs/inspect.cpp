// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"
#include "app/pipeline/stage_record.hpp"
#include "core/session.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;

json describe(const Session& session, Modality modality) {
  int stations = 0, tracking = 0, posed = 0, with_station = 0, gray = 0;
  std::uint64_t lost = 0;
  std::string size;
  for (const FrameRecord* frame : session.frames_of(modality)) {
    ++(frame->tracking ? tracking : stations);
    posed += frame->cam_from_world.has_value();
    with_station += frame->station.has_value();
    gray += frame->thermal_is_gray;
    if (size.empty()) size = fmt::format("{}x{}", frame->width, frame->height);
  }
  json devices = json::array();
  for (const DeviceInfo& device : session.devices) {
    if (device.modality != modality) continue;
    devices.push_back({{"id", device.id}, {"driver", device.driver}, {"model", device.model}});
    for (const GapRecord& gap : session.gaps)
      if (gap.device == device.id) lost += gap.count;
  }
  return {{"frames", stations}, {"tracking", tracking}, {"with_pose", posed},
          {"with_station", with_station}, {"size", size}, {"lost", lost},
          {"has_temperatures", modality == Modality::thermal && gray < stations + tracking},
          {"devices", devices}};
}

Status inspect_run(Context& context, const fs::path& folder) {
  json stages = json::array();
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.is_directory() || !fs::exists(entry.path() / pipeline::stage_record_file)) continue;
    const auto record = pipeline::read_stage_record(entry.path());
    if (!record) {
      context.console.warning(record.error().message());
      continue;
    }
    context.console.data(fmt::format("{:<14} {}  {:>7.1f} s  {}", record->stage, record->finished_utc,
                                     record->wall_s,
                                     record->output.metrics.value("brief", std::string())));
    stages.push_back(to_json(*record));
  }
  context.result = {{"out", folder.string()}, {"stages", stages}};
  return {};
}

Status inspect_session(Context& context, const fs::path& folder) {
  ORBITFUSE_ASSIGN(const Session session, open_session(folder));
  context.console.data(fmt::format("session {} of {}{}", session.id, session.created,
                                   session.complete ? "" : ", incomplete: the recorder was stopped"));
  context.result = {{"session", folder.string()}, {"id", session.id}, {"created", session.created},
                    {"complete", session.complete}, {"warnings", session.warnings}};
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const json j = describe(session, modality);
    context.result[std::string(name(modality))] = j;
    if (j["frames"] == 0 && j["tracking"] == 0) {
      context.console.data(fmt::format("{}: no frames", name(modality)));
      continue;
    }
    context.console.data(fmt::format(
        "{}: {} frames of {}, {} tracking, {} with a station, {} with a pose, {} lost{}",
        name(modality), j["frames"].get<int>(), j["size"].get<std::string>(), j["tracking"].get<int>(),
        j["with_station"].get<int>(), j["with_pose"].get<int>(), j["lost"].get<std::uint64_t>(),
        modality == Modality::visible  ? ""
        : j["has_temperatures"] == true ? ", temperatures"
                                        : ", gray levels"));
  }
  for (const std::string& warning : session.warnings) context.console.warning(warning);
  return {};
}

}  // namespace

Action add_inspect(CLI::App& app) {
  const auto folder = std::make_shared<std::string>();
  app.add_option("folder", *folder, "Session folder, or the --out folder of a run")->required();
  return [folder](Context& context) {
    return fs::exists(fs::path(*folder) / "run.json") ? inspect_run(context, *folder)
                                                      : inspect_session(context, *folder);
  };
}

}  // namespace orbitfuse::cli
