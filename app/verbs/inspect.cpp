// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "app/cli/run_folder.hpp"
#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"
#include "app/pipeline/result_folder.hpp"
#include "app/pipeline/stage_record.hpp"
#include "app/stages/artifacts.hpp"
#include "app/stages/build_stages.hpp"
#include "app/stages/measurement_scene.hpp"
#include "app/stages/metric_scale.hpp"
#include "app/stages/session_input.hpp"
#include "capture/recording/session_folder.hpp"
#include "core/session/session.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;

/// The frames of each camera, lens and image size: they may not be mixed up.
json groups_of(const Session& session, Modality modality) {
  std::map<std::tuple<std::string, int, int>, int> frames;
  for (const FrameRecord* frame : session.frames_of(modality))
    ++frames[{frame->device, frame->width, frame->height}];
  json groups = json::array();
  for (const auto& [key, count] : frames) {
    const auto& [id, width, height] = key;
    json group = {{"device", id}, {"size", fmt::format("{}x{}", width, height)}, {"frames", count}};
    if (const DeviceInfo* device = session.device(id)) {
      group["model"] = device->model;
      group["serial"] = device->serial;
      if (device->lens.focal_px) group["focal_px"] = *device->lens.focal_px;
    }
    groups.push_back(group);
  }
  return groups;
}

std::string described(const json& group) {
  std::string text = fmt::format("  {}: {} frames of {}", group["device"].get<std::string>(),
                                 group["frames"].get<int>(), group["size"].get<std::string>());
  for (const char* known : {"model", "serial"}) {
    if (const std::string value = group.value(known, std::string()); !value.empty())
      text += ", " + value;
  }
  if (group.contains("focal_px"))
    text += fmt::format(", focal length about {:.0f} px", group["focal_px"].get<double>());
  return text;
}

json describe(const Session& session, Modality modality) {
  int stations = 0, tracking = 0, posed = 0, with_station = 0, gray = 0;
  std::uint64_t lost = 0;
  for (const FrameRecord* frame : session.frames_of(modality)) {
    ++(frame->tracking ? tracking : stations);
    posed += frame->cam_from_world.has_value();
    with_station += frame->station.has_value();
    gray += frame->thermal_is_gray;
  }
  json devices = json::array();
  for (const DeviceInfo& device : session.devices) {
    if (device.modality != modality) continue;
    devices.push_back({{"id", device.id}, {"driver", device.driver}, {"model", device.model}});
    for (const GapRecord& gap : session.gaps)
      if (gap.device == device.id) lost += gap.count;
  }
  const json groups = groups_of(session, modality);
  std::vector<std::string> sizes;
  for (const json& group : groups) {
    const auto size = group["size"].get<std::string>();
    if (std::find(sizes.begin(), sizes.end(), size) == sizes.end()) sizes.push_back(size);
  }
  return {{"frames", stations},
          {"tracking", tracking},
          {"with_pose", posed},
          {"with_station", with_station},
          {"size", fmt::format("{}", fmt::join(sizes, ", "))},
          {"lost", lost},
          {"groups", groups},
          {"has_temperatures", modality == Modality::thermal && gray < stations + tracking},
          {"devices", devices}};
}

/// A folder that another session was put into since: its photos are not the run's.
void tell_exchanged(Context& context, const fs::path& folder, const std::string& session) {
  const auto opened = open_session(session);
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const Status same =
        opened ? stages::check_session_of_run(stages::context_of_run(folder), *opened, modality)
               : tl::unexpected(opened.error());
    if (same) continue;
    context.console.warning(same.error().message());
    return;
  }
}

/// Results outlive their session; what can't be done without it is worth knowing before.
void tell_session(Context& context, const fs::path& folder, const std::string& session) {
  context.console.data("of session " + session);
  context.result["session"] = session;
  std::error_code unreadable;
  const bool there = fs::exists(fs::path(session) / "manifest.jsonl", unreadable);
  context.result["session_found"] = there;
  if (there) return tell_exchanged(context, folder, session);
  context.console.warning(fmt::format(
      "its session {} is not there any more: nothing can be measured, evaluated or run "
      "again; bring it back, or name it where it is now: orbitfuse run SESSION --out {}",
      session, folder.string()));
}

constexpr const char* record_missing = ": its record is missing";

/// What lies in the place of a stage's result without being one: no verb reads it, and a run
/// refuses to replace it.
void tell_without_record(Context& context, const fs::path& folder,
                         const std::set<std::string>& finished, std::vector<std::string>& damaged) {
  json names = json::array();
  for (const std::string& stage : stages::stage_names()) {
    std::error_code unreadable;
    const fs::path place = folder / stage;
    if (!fs::exists(fs::symlink_status(place, unreadable)) || finished.contains(stage) ||
        (fs::is_directory(place, unreadable) && fs::is_empty(place, unreadable)))
      continue;
    names.push_back(stage);
    damaged.push_back(stage + record_missing);
    context.console.warning(fmt::format(
        "{}: there, but without a record ({}): nothing uses it, and the next run refuses to "
        "replace it; move it away, and run again",
        stage, pipeline::stage_record_file));
  }
  context.result["without_record"] = names;
}

/// Stages that missed their gate; why is in no other place that a user looks at.
void tell_failed(Context& context, const fs::path& folder) {
  context.result["failed"] = json::object();
  for (const std::string& stage : stages::stage_names()) {
    const std::string why = pipeline::why_failed(folder, stage);
    if (why.empty()) continue;
    context.result["failed"][stage] = why;
    context.console.warning(
        why == "?" ? fmt::format("{}.failed: there, but no run left it: the next run refuses to "
                                 "replace it; move it away",
                                 stage)
                   : fmt::format("{} failed: {}", stage, why));
  }
}

/// What run.json keeps for the next call, which would refuse it.
std::optional<std::string> unusable_options(const Context& context, const fs::path& folder) {
  stages::RunConfig config = context.config;
  config::Settings settings = config.settings();
  const auto options = read_earlier_options(folder.string(), settings);
  if (options) return std::nullopt;
  return options.error().where + ": " + options.error().found;
}

Status inspect_run(Context& context, const fs::path& folder) {
  json stages = json::array();
  std::vector<std::string> damaged;
  std::error_code error;
  const fs::directory_iterator readable(folder, error);
  if (error)
    return fail(ErrorKind::input, folder.string(), error.message(), "check the permissions");
  const std::set<std::string> finished = pipeline::finished_stages(folder, stages::stage_names());
  for (const std::string& stage : finished) {
    const auto record = pipeline::read_stage_record(folder / stage);
    if (!record) {
      context.console.warning(record.error().message());
      damaged.push_back(stage + ": " + record.error().found);
      continue;
    }
    if (const auto wrong = pipeline::damage(folder / stage, *record)) {
      context.console.warning(record->stage + ": " + *wrong + "; the next run makes it again");
      damaged.push_back(record->stage + ": " + *wrong);
    }
    context.console.data(fmt::format("{:<14} {}  {:>7.1f} s  {}", record->stage,
                                     record->finished_utc, record->wall_s,
                                     record->output.metrics.value("brief", std::string())));
    for (const std::string& warning : record->output.warnings)
      context.console.warning(record->stage + ": " + warning);
    stages.push_back(to_json(*record));
  }
  tell_without_record(context, folder, finished, damaged);
  tell_failed(context, folder);
  const std::vector<std::string> late = pipeline::out_of_date(folder, finished);
  for (const std::string& stage : late)
    context.console.warning(stage + "; the next run makes it again");
  const auto run = earlier_run(folder.string());
  if (!run || run->is_null()) {
    damaged.push_back(run ? "run.json: missing, so that nothing names the session"
                          : std::string("run.json: ") + run.error().found);
    context.console.warning(damaged.back() + "; run again with the session folder and --out");
  } else {
    tell_session(context, folder, (*run)["session"]);
    if (const auto wrong = unusable_options(context, folder)) {
      damaged.push_back(*wrong);
      context.console.warning(*wrong + "; run again with the session folder and --out");
    }
  }
  const auto scale = stages::scale_of_run(folder);
  context.result["scale"] = scale && *scale ? to_json(**scale) : json();
  if (scale)
    context.console.data(stages::scale_words(scale));
  else
    context.console.warning(stages::scale_words(scale));
  context.result.update(
      {{"out", folder.string()}, {"stages", stages}, {"damaged", damaged}, {"out_of_date", late}});
  if (damaged.empty() && !scale) return tl::unexpected(scale.error());
  if (damaged.empty()) return {};
  return fail(ErrorKind::input, folder.string(), damaged.front(),
              damaged.front().ends_with(record_missing)
                  ? "move its folder away and run again: nothing is written over what no run left"
                  : "run again: what is damaged is made anew");
}

Status verdict_of(const Session& session, const std::vector<Error>& damaged) {
  const std::string where = session.folder.string();
  if (!damaged.empty())
    return fail(ErrorKind::input, where,
                fmt::format("{} of {} frames are damaged, first {}", damaged.size(),
                            session.frames.size(), damaged.front().where),
                "copy them from the original, or import the session again");
  if (!session.missing_files.empty())
    return fail(ErrorKind::input, where,
                fmt::format("{} of {} frames are missing, first {}", session.missing_files.size(),
                            session.frames.size() + session.missing_files.size(),
                            session.missing_files.front()),
                "copy them from the original, or import the session again; a run goes on without "
                "them");
  if (session.lost_lines > 0)
    return fail(ErrorKind::input, where,
                fmt::format("{} of its frames are in no line of the manifest", session.lost_lines),
                "restore the manifest from a backup; a run goes on without them");
  return {};
}

Status inspect_session(Context& context, const fs::path& folder) {
  ORBITFUSE_ASSIGN(const Session session, open_session(folder));
  const bool recorded_now = !session.complete && is_being_recorded(folder);
  context.console.data(fmt::format("session {} of {}{}", session.id, session.created,
                                   recorded_now       ? ", being recorded now"
                                   : session.complete ? ""
                                                      : ", incomplete: the recorder was stopped"));
  context.result = {{"session", folder.string()},     {"id", session.id},
                    {"created", session.created},     {"complete", session.complete},
                    {"being_recorded", recorded_now}, {"warnings", session.warnings}};
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const json j = describe(session, modality);
    context.result[std::string(name(modality))] = j;
    if (j["frames"] == 0 && j["tracking"] == 0) {
      context.console.data(fmt::format("{}: no frames", name(modality)));
      continue;
    }
    context.console.data(fmt::format(
        "{}: {} frames of {}, {} tracking, {} with a station, {} with a pose, {} lost{}",
        name(modality), j["frames"].get<int>(), j["size"].get<std::string>(),
        j["tracking"].get<int>(), j["with_station"].get<int>(), j["with_pose"].get<int>(),
        j["lost"].get<std::uint64_t>(),
        modality == Modality::visible   ? ""
        : j["has_temperatures"] == true ? ", temperatures"
                                        : ", gray levels"));
    if (j["groups"].size() > 1)
      for (const json& group : j["groups"]) context.console.data(described(group));
  }
  for (const std::string& warning : session.warnings) context.console.warning(warning);
  ORBITFUSE_ASSIGN(const stages::FrameFindings found,
                   stages::look_at_frames(session, context.progress));
  const auto& damaged = found.damaged;
  context.result["changed"] = found.changed;
  for (const std::string& file : found.changed)
    context.console.warning(file + ": changed since it was recorded; it is used as it is now");
  context.result["damaged"] = json::array();
  for (const Error& error : damaged) {
    context.result["damaged"].push_back(error.message());
    context.console.warning("damaged: " + error.message());
  }
  context.result["missing"] = session.missing_files;
  context.result["lost_lines"] = session.lost_lines;
  return verdict_of(session, damaged);
}

}  // namespace

Action add_inspect(CLI::App& app) {
  const auto folder = std::make_shared<std::string>();
  app.add_option("folder", *folder, "Session folder, or the --out folder of a run")->required();
  return [folder](Context& context) {
    std::error_code unreadable;  // inspect_session says why
    const bool run = fs::exists(fs::path(*folder) / run_file, unreadable) ||
                     (!fs::exists(fs::path(*folder) / "manifest.jsonl", unreadable) &&
                      !pipeline::finished_stages(*folder, stages::stage_names()).empty());
    return run ? inspect_run(context, *folder) : inspect_session(context, *folder);
  };
}

}  // namespace orbitfuse::cli
