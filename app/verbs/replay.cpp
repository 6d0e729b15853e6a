// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/replay/replay_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/cli/run_folder.hpp"
#include "app/cli/verb.hpp"
#include "app/pipeline/out_folder.hpp"
#include "app/recording/recording.hpp"

namespace orbitfuse::cli {
namespace {

struct ReplayArguments {
  std::string session, to, speed = "full";
};

Result<std::vector<std::unique_ptr<FrameSource>>> sources_of(Context& context,
                                                             const Session& session,
                                                             ReplaySpeed speed) {
  std::vector<std::unique_ptr<FrameSource>> sources;
  for (const DeviceInfo& device : session.devices) {
    const bool has_frames =
        std::any_of(session.frames.begin(), session.frames.end(),
                    [&](const FrameRecord& frame) { return frame.device == device.id; });
    if (has_frames)
      sources.push_back(make_replay_source(session, device.id, speed));
    else
      context.console.warning(device.id + ": no frames, left out");
  }
  if (sources.empty())
    return fail(ErrorKind::input, session.folder.string(), "no frames", "replay another session");
  return sources;
}

/// Frames of two sessions in one would be two objects in one, and nothing tells them apart later.
Status check_goes_on(const Session& session, const std::string& to) {
  ORBITFUSE_ASSIGN(const Session begun, open_session(to));
  // Thermal files may have been stored anew at a coarser scale: their time stays.
  std::set<std::string> hashes;
  std::set<std::pair<Modality, std::int64_t>> times;
  for (const FrameRecord& frame : session.frames) {
    hashes.insert(frame.content_hash);
    if (frame.host_time_ns) times.emplace(frame.modality, *frame.host_time_ns);
  }
  const bool known = std::any_of(begun.frames.begin(), begun.frames.end(), [&](const auto& frame) {
    return (!frame.content_hash.empty() && hashes.contains(frame.content_hash)) ||
           (frame.host_time_ns && times.contains({frame.modality, *frame.host_time_ns}));
  });
  if (known || begun.frames.empty()) return {};
  return fail(ErrorKind::input, to,
              fmt::format("holds {} frames, none of them of {}", begun.frames.size(),
                          session.folder.string()),
              "replay into a folder of its own, or go on with the replay of this session");
}

Status run(Context& context, const ReplayArguments& o) {
  ORBITFUSE_ASSIGN(const Session session, open_session(o.session));
  for (const std::string& warning : session.warnings) context.console.warning(warning);
  ORBITFUSE_ASSIGN(
      auto sources,
      sources_of(context, session, o.speed == "full" ? ReplaySpeed::full : ReplaySpeed::recorded));
  recording::RecordingOptions options;
  options.session = o.to;
  options.resume = context.common.resume;
  options.notes = session.notes;
  ORBITFUSE_TRY(pipeline::check_outside_stages(o.to));  // before the next one makes the folder
  ORBITFUSE_TRY(recording::check_folder(options));
  if (lies_among_frames(o.to, o.session))
    return fail(ErrorKind::usage, "--to " + o.to, "lies among the frames of the session itself",
                "choose another folder");
  if (options.resume) ORBITFUSE_TRY(check_goes_on(session, o.to));
  if (context.common.dry_run) {
    context.console.info(fmt::format("would replay {} frames of {} devices into {}",
                                     session.frames.size(), sources.size(), o.to));
    return {};
  }
  recording::Recording recording(std::move(sources), options);
  ORBITFUSE_TRY(recording.prepare(context.progress.cancel));
  const auto ending = recording.run(context.progress.cancel, [&] {
    std::uint64_t written = 0;
    for (const StreamStatus& s : recording.status()) written += s.received;
    context.progress.report(
        {"replay", static_cast<double>(written), static_cast<double>(session.frames.size())});
  });
  auto streams = nlohmann::json::array();
  for (const StreamStatus& s : recording.status()) {
    context.console.data(s.notice.empty()
                             ? fmt::format("{}: {} received, {} lost", s.device, s.received, s.lost)
                             : s.device + ": " + s.notice);
    streams.push_back({{"device", s.device}, {"received", s.received}, {"lost", s.lost}});
  }
  context.result = {{"session", o.to}, {"streams", streams}};
  if (!ending) return tl::unexpected(ending.error());
  return {};
}

}  // namespace

Action add_replay(CLI::App& app) {
  const auto options = std::make_shared<ReplayArguments>();
  app.add_option("session", options->session, "Recorded session")->required();
  app.add_option("--to", options->to, "Session folder: new, or with --resume one to go on with")
      ->required();
  app.add_option("--speed", options->speed, "full, or recorded: as long between frames as then")
      ->check(CLI::IsMember({"full", "recorded"}))
      ->capture_default_str();
  return [options](Context& context) { return run(context, *options); };
}

}  // namespace orbitfuse::cli
