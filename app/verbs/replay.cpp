// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/replay/replay_source.hpp"

#include <fmt/format.h>

#include "app/cli/verb.hpp"
#include "capture/recorder.hpp"
#include "capture/session_writer.hpp"

namespace orbitfuse::cli {
namespace {

struct Options {
  std::string session, to, speed = "full";
};

Status run(Context& context, const Options& o) {
  ORBITFUSE_ASSIGN(const Session session, open_session(o.session));
  for (const std::string& warning : session.warnings) context.console.warning(warning);
  const auto sources = make_replay_sources(
      session, o.speed == "full" ? ReplaySpeed::full : ReplaySpeed::recorded);
  std::vector<FrameSource*> pointers;
  for (const auto& source : sources) pointers.push_back(source.get());
  if (context.common.dry_run) {
    context.console.info(fmt::format("would replay {} frames of {} devices into {}",
                                     session.frames.size(), sources.size(), o.to));
    return {};
  }
  ORBITFUSE_ASSIGN(const auto writer, SessionWriter::create(o.to, session.notes));
  RecorderOptions options;
  options.backpressure = Backpressure::wait;
  Recorder recorder(*writer, options);
  std::atomic<int> written{0};
  recorder.on_frame = [&](const FrameRecord& frame) {
    context.progress.report({"replay", static_cast<double>(++written),
                             static_cast<double>(session.frames.size()), -1, frame.file});
  };
  ORBITFUSE_TRY(recorder.run(pointers, context.progress));
  ORBITFUSE_TRY(writer->close());
  auto streams = nlohmann::json::array();
  for (const StreamStatus& s : recorder.status()) {
    context.console.data(fmt::format("{}: {} received, {} lost", s.device, s.received, s.lost));
    streams.push_back({{"device", s.device}, {"received", s.received}, {"lost", s.lost}});
  }
  context.result = {{"session", o.to}, {"streams", streams}};
  return {};
}

}  // namespace

Action add_replay(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  app.add_option("session", options->session, "Recorded session")->required();
  app.add_option("--to", options->to, "New session folder")->required();
  app.add_option("--speed", options->speed, "full, or recorded: as long between frames as then")
      ->check(CLI::IsMember({"full", "recorded"}))->capture_default_str();
  return [options](Context& context) { return run(context, *options); };
}

}  // namespace orbitfuse::cli
