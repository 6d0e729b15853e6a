// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "app/pipeline/out_folder.hpp"
#include "app/recording/rehearsal.hpp"
#include "app/verbs/capture_options.hpp"
#include "app/verbs/capture_teller.hpp"
#include "capture/live/live_state.hpp"

namespace orbitfuse::cli {
namespace {

using nlohmann::json;

json known_or_null(const std::string& text) { return text.empty() ? json() : json(text); }

/// A folder that photos come to may still be empty; a camera may not be silent.
Status expect_frames(Context& context, const recording::Rehearsal& r) {
  if (r.frames > 0) return {};
  if (r.device.driver == "stills") {
    context.console.info(
        r.device.id + ": no new photo came meanwhile; those that come to the folder will be taken");
    return {};
  }
  return fail(ErrorKind::device, r.device.id, "opened, but delivered no frame",
              "check the camera and its cable (orbitfuse doctor)");
}

Status rehearse(Context& context, const CaptureOptions& o, const recording::Cameras& cameras) {
  ORBITFUSE_ASSIGN(
      const auto list,
      recording::rehearse(cameras.sources, o.seconds > 0 ? o.seconds : 2, context.progress.cancel));
  if (context.progress.cancelled())
    return fail(ErrorKind::cancelled, "capture", "dry run stopped by the user",
                "nothing was written");
  auto streams = json::array();
  for (const recording::Rehearsal& r : list) {
    context.console.data(fmt::format(
        "{} ({}): {} frames{}{}, {} rejected, {} missing", r.device.id, described(r.device),
        r.frames, r.frames > 0 ? fmt::format(" of {}x{}", r.width, r.height) : "",
        cameras.live && r.rate_hz > 0 ? fmt::format(" at {:.1f} Hz", r.rate_hz) : "", r.rejected,
        r.missing));
    for (const auto& [reason, times] : r.reasons) {
      const auto last = r.details.find(reason);
      context.console.warning(fmt::format("{}: {} ({} {}){}", r.device.id, reason, times,
                                          times == 1 ? "time" : "times",
                                          last == r.details.end() ? "" : ", last " + last->second));
    }
    streams.push_back({{"device", r.device.id},
                       {"driver", r.device.driver},
                       {"model", known_or_null(r.device.model)},
                       {"serial", known_or_null(r.device.serial)},
                       {"frames", r.frames},
                       {"rejected", r.rejected},
                       {"missing", r.missing},
                       {"rate_hz", r.rate_hz},
                       {"width", r.width},
                       {"height", r.height},
                       {"reasons", r.reasons}});
    ORBITFUSE_TRY(expect_frames(context, r));
  }
  context.console.info("nothing was written");
  context.result = {{"dry_run", true}, {"streams", streams}};
  return {};
}

/// The page, and what its start button waits for.
struct Page {
  std::unique_ptr<WebServer> server;
  std::atomic<bool> started{false};
};

Status open_page(Context& context, const CaptureOptions& o, recording::Recording& recording,
                 Page& page) {
  if (o.page.empty()) return {};
  ORBITFUSE_ASSIGN(const PageOptions options, page_of(o));
  PageHooks hooks;
  hooks.state = [&recording] { return recording.state(); };
  hooks.latest = [&recording](Modality modality) { return recording.latest(modality); };
  const auto button = [&context](auto action) {
    return [&context, action]() -> Result<std::string> {
      return tell_outcome(context.console, action());
    };
  };
  hooks.start = button([&page, waits = o.wait_for_start]() -> Result<std::string> {
    if (!waits || page.started.exchange(true))
      return fail(ErrorKind::usage, "Start", "the recording has begun already", "go on with it");
    return "recording begins";
  });
  hooks.stop = button([&recording] { return recording.request_stop(); });
  hooks.at_station = button([&recording] { return recording.operator_at_station(); });
  hooks.correct = button([&recording] { return recording.request_correction(); });
  page.server = std::make_unique<WebServer>(options, capture_page(std::move(hooks)));
  ORBITFUSE_TRY(page.server->start());
  for (const std::string& url : page.server->urls()) context.console.info("page: " + url);
  context.console.event({{"event", "page"}, {"url", page.server->url()}});
  if (o.wait_for_start) {
    context.console.info("waiting for Start on the page");
    const auto over = [&] {
      return page.started || recording.stop_requested() || context.progress.cancelled();
    };
    ORBITFUSE_TRY(recording.show_until(over, context.progress.cancel));
  }
  if (!context.progress.cancelled() && !recording.stop_requested()) return {};
  return fail(ErrorKind::cancelled, "capture", "stopped before it began",
              "nothing was recorded; start it again");
}

/// Whether the page could be served; it is gone again on return.
Status try_page(const CaptureOptions& o) {
  if (o.page.empty()) return {};
  ORBITFUSE_ASSIGN(const PageOptions options, page_of(o));
  PageHooks hooks;
  hooks.state = [] { return LiveState{}; };
  return WebServer(options, capture_page(std::move(hooks))).start();
}

std::string absence(const StreamStatus& s) {
  return s.away ? fmt::format("; away for the last {:.1f} s", s.away->seconds) : "";
}

void account(Context& context, recording::Recording& recording) {
  auto streams = json::array();
  for (const StreamStatus& s : recording.status()) {
    context.console.data(s.any() ? fmt::format("{}: {} of ids {} to {}{}", s.device,
                                               account_words(s), s.first_id, s.last_id, absence(s))
                                 : s.device + ": no frame came" + absence(s));
    for (const std::string& words : {passed_over(s), damaged(s)})
      if (!words.empty()) context.console.data(words);
    streams.push_back(account_json(s));
  }
  context.result["session"] = recording.folder().string();
  context.result["streams"] = streams;
  if (!recording.guide()) return;
  auto guide = json::object();
  for (const LiveCamera& camera : recording.guide()->cameras()) {
    const int done = recording.guide()->done_count(camera.modality);
    const std::size_t of = recording.guide()->sectors().size();
    context.console.data(fmt::format("{}: {} of {} stations", name(camera.modality), done, of));
    guide[std::string(name(camera.modality))] = {{"done", done}, {"of", of}};
  }
  context.result["stations"] = guide;
}

Status run(Context& context, const CaptureOptions& o) {
  ORBITFUSE_TRY(o.validate());
  ORBITFUSE_TRY(pipeline::check_outside_stages(o.session));
  ORBITFUSE_ASSIGN(recording::Cameras cameras, cameras_of(o));
  recording::RecordingOptions options;
  ORBITFUSE_ASSIGN(options.guide, guide_of(o, cameras));
  options.session = o.session;
  options.resume = context.common.resume;
  options.live = cameras.live;
  options.choose_stations = cameras.live && options.guide;
  options.seconds = o.seconds;
  options.stop_when_complete = o.stop_when_complete;
  options.notes = {{"recorded_by", "capture"}};
  ORBITFUSE_ASSIGN(PositionFinder finder, finder_of(o, cameras));
  // Before the page opens: who presses start there has left the terminal.
  ORBITFUSE_TRY(recording::check_folder(options));
  if (context.common.dry_run) {
    ORBITFUSE_TRY(try_page(o));
    return rehearse(context, o, cameras);
  }
  recording::Recording recording(std::move(cameras.sources), options, std::move(finder));
  Page page;
  ORBITFUSE_TRY(open_page(context, o, recording, page));
  ORBITFUSE_TRY(recording.prepare(context.progress.cancel));
  for (const DeviceInfo& device : recording.devices())
    context.console.info(device.id + ": " + described(device));
  if (options.live)
    context.console.info(
        fmt::format("recording; {}n: shutter correction (NUC) now, q or Ctrl-C: stop",
                    options.guide ? "Enter: at the next station, " : ""));
  Teller teller(context, recording, options.live, o.view);
  const auto ending = recording.run(context.progress.cancel, [&] { teller.tick(); });
  account(context, recording);
  if (!ending) return tl::unexpected(ending.error());
  return {};
}

}  // namespace

Action add_capture(CLI::App& app) {
  const auto options = std::make_shared<CaptureOptions>();
  add_capture_options(app, *options);
  return [options](Context& context) { return run(context, *options); };
}

}  // namespace orbitfuse::cli
