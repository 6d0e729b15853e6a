// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <charconv>
#include <set>
#include <thread>

#include "app/cli/verb.hpp"
#include "app/recording/open_cameras.hpp"
#include "app/recording/recording.hpp"
#include "app/recording/rehearsal.hpp"
#include "capture/mat/mat_finder.hpp"
#include "capture/page/page_server.hpp"

namespace orbitfuse::cli {
namespace {

using nlohmann::json;

struct Options {
  std::string session, driver, visible, thermal, profiles, guide = "auto", mat = "paper";
  int mat_tags = 0;
  double seconds = 0, spacing_deg = 0, turntable_deg = 0;
  std::vector<double> elevations_deg, max_edge_px;
  bool stop_when_complete = false, view = false, wait_for_start = false;
  std::string page, token;
};

Result<recording::Cameras> cameras_of(const Options& o) {
  recording::Cameras cameras;
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const std::string& own = modality == Modality::visible ? o.visible : o.thermal;
    const std::string& text = own.empty() ? o.driver : own;
    if (text.empty()) continue;
    ORBITFUSE_ASSIGN(const recording::CameraSpec spec, recording::parse_camera_spec(text));
    ORBITFUSE_TRY(recording::add_cameras(spec, modality, o.profiles, cameras));
  }
  if (cameras.sources.empty()) {
    return fail(ErrorKind::usage, "cameras", "none named",
                "give --visible, --thermal or --driver (orbitfuse devices lists them)");
  }
  return cameras;
}

/// The orbits to be walked: the command line's, else those of the stations that the frames carry.
Result<std::optional<LiveGuideOptions>> guide_of(const Options& o,
                                                 const recording::Cameras& cameras) {
  if (o.guide == "off") return std::optional<LiveGuideOptions>{};
  LiveGuideOptions guide;
  if (cameras.plan) guide.plan = *cameras.plan;
  if (o.spacing_deg > 0) guide.plan.spacing_deg = o.spacing_deg;
  guide.turntable_step_deg = o.turntable_deg;
  if (!o.max_edge_px.empty()) {
    guide.coverage.max_visible_edge_px = o.max_edge_px[0];
    guide.coverage.max_thermal_edge_px = o.max_edge_px[1];
  }
  if (!o.elevations_deg.empty()) guide.plan.loop_elevations_deg = o.elevations_deg;
  std::set<Modality> modalities;
  for (const auto& source : cameras.sources) modalities.insert(source->describe().modality);
  guide.plan.modalities.assign(modalities.begin(), modalities.end());
  ORBITFUSE_TRY(guide.validate());
  return std::optional<LiveGuideOptions>(guide);
}

/// Finds the mat in what live cameras see; frames that carry their stations need none.
Result<PositionFinder> finder_of(const Options& o, const recording::Cameras& cameras) {
  if (o.guide == "off" || o.guide == "key" || o.turntable_deg != 0 || cameras.stations)
    return PositionFinder{};
  MatDesign design = o.mat == "foil" ? MatDesign::for_thermal(0.6) : MatDesign{};
  if (o.mat_tags > 0) design.tags_per_side = o.mat_tags;
  ORBITFUSE_TRY(design.validate());
  const auto mat = std::make_shared<MatFinder>(design);
  for (const auto& source : cameras.sources) {
    const DeviceInfo device = source->describe();
    if (device.lens.focal_px) mat->set_focal_px(device.modality, *device.lens.focal_px);
  }
  return PositionFinder(
      [mat](const cv::Mat& image, Modality modality) -> std::optional<OrbitPosition> {
        const std::optional<MatSighting> sighting = mat->find(image, modality);
        if (!sighting) return std::nullopt;
        return sighting->position;
      });
}

Status rehearse(Context& context, const Options& o, const recording::Cameras& cameras) {
  ORBITFUSE_ASSIGN(
      const auto list,
      recording::rehearse(cameras.sources, o.seconds > 0 ? o.seconds : 2, context.progress.cancel));
  auto streams = json::array();
  for (const recording::Rehearsal& r : list) {
    context.console.data(fmt::format(
        "{} ({} {}): {} frames of {}x{}{}, {} rejected, {} missing", r.device.id, r.device.driver,
        r.device.model, r.frames, r.width, r.height,
        cameras.live ? fmt::format(" at {:.1f} Hz", r.rate_hz) : "", r.rejected, r.missing));
    for (const auto& [reason, times] : r.reasons)
      context.console.warning(fmt::format("{}: {} ({} times)", r.device.id, reason, times));
    streams.push_back({{"device", r.device.id},
                       {"driver", r.device.driver},
                       {"model", r.device.model},
                       {"serial", r.device.serial},
                       {"frames", r.frames},
                       {"rejected", r.rejected},
                       {"missing", r.missing},
                       {"rate_hz", r.rate_hz},
                       {"width", r.width},
                       {"height", r.height},
                       {"reasons", r.reasons}});
    if (r.frames == 0) {
      return fail(ErrorKind::device, r.device.id, "opened, but delivered no frame",
                  "check the camera and its cable (orbitfuse doctor)");
    }
  }
  context.console.info("nothing was written");
  context.result = {{"dry_run", true}, {"streams", streams}};
  return {};
}

/// Says each instruction and each alarm once, and listens to the operator's keys.
class Teller {
 public:
  /// `live`: the operator is there to hear the instructions.
  Teller(Context& context, recording::Recording& recording, bool live, bool view)
      : context_(context), recording_(recording), live_(live), view_(view) {}

  void tick() {
    listen();
    if (view_) draw();
    for (const StreamStatus& s : recording_.status()) {
      say_changed(s.device + " silent", s.silent ? s.device + ": no frames" : "");
      say_changed(s.device + " notice", s.notice.empty() ? "" : s.device + ": " + s.notice);
      say_changed(
          s.device + " dropped",
          s.dropped > 0 ? s.device + ": the disk is too slow, frames are dropped and counted" : "");
      say_changed(s.device + " missing",
                  s.missing > 0 ? s.device + ": frames are lost on the way and counted" : "");
      say_changed(s.device + " rejected",
                  s.rejected > 0 ? s.device + ": frames arrive damaged and are counted" : "");
    }
    if (!recording_.guide()) return;
    const auto total = recording_.guide()->sectors().size();
    for (const LiveCamera& camera : recording_.guide()->cameras()) {
      const int done = recording_.guide()->done_count(camera.modality);
      const std::string words =
          fmt::format("{} {}/{}: {}", name(camera.modality), done, total, camera.instruction);
      std::string& last = said_[std::string(name(camera.modality))];
      if (words == last) continue;
      last = words;
      if (live_ && !view_)
        context_.console.info(words);
      else
        context_.console.detail(words);
      context_.console.event({{"event", "guide"},
                              {"modality", name(camera.modality)},
                              {"done", done},
                              {"of", total},
                              {"instruction", camera.instruction}});
    }
  }

 private:
  /// The whole state once a second, in place on a terminal.
  void draw() {
    const auto now = std::chrono::steady_clock::now();
    if (now - drawn_ < std::chrono::seconds(1)) return;
    drawn_ = now;
    context_.console.data((isatty(STDOUT_FILENO) ? "\033[H\033[J" : "") +
                          terminal_view(recording_.state()));
  }

  void say_changed(const std::string& key, const std::string& words) {
    std::string& last = said_[key];
    if (words != last && !words.empty()) context_.console.warning(words);
    last = words;
  }

  void listen() {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (!isatty(STDIN_FILENO) || poll(&input, 1, 0) <= 0) return;
    char keys[64];
    const ssize_t count = ::read(STDIN_FILENO, keys, sizeof keys);
    if (count > 0 && keys[0] == 'q')
      recording_.request_stop();
    else if (count > 0 && keys[0] == 'n')
      recording_.request_correction();
    else if (count > 0 && recording_.guide())
      recording_.operator_at_station();
  }

  Context& context_;
  recording::Recording& recording_;
  bool live_, view_;
  std::chrono::steady_clock::time_point drawn_{};
  std::map<std::string, std::string> said_;
};

/// "PORT", "HOST:PORT" or "[IPv6]:PORT".
Result<PageOptions> page_options(const Options& o) {
  PageOptions page;
  page.token = o.token;
  page.require_token = !o.token.empty();
  const std::size_t colon = o.page.rfind(':');
  const std::string port = colon == std::string::npos ? o.page : o.page.substr(colon + 1);
  if (colon != std::string::npos) page.host = o.page.substr(0, colon);
  if (page.host.starts_with("[") && page.host.ends_with("]"))
    page.host = page.host.substr(1, page.host.size() - 2);
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), page.port);
  if (error != std::errc{} || end != port.data() + port.size() || page.host.empty()) {
    return fail(ErrorKind::usage, "--page " + o.page, "not an address",
                "write PORT or HOST:PORT, e.g. 0.0.0.0:8470");
  }
  ORBITFUSE_TRY(page.validate());
  return page;
}

/// The page, and what its start button waits for.
struct Page {
  std::unique_ptr<PageServer> server;
  std::atomic<bool> started{false};
};

Status open_page(Context& context, const Options& o, recording::Recording& recording, Page& page) {
  if (o.page.empty()) return {};
  ORBITFUSE_ASSIGN(const PageOptions options, page_options(o));
  PageHooks hooks;
  hooks.state = [&recording] { return recording.state(); };
  hooks.latest = [&recording](Modality modality) { return recording.latest(modality); };
  hooks.start = [&page] { page.started = true; };
  hooks.stop = [&recording] { recording.request_stop(); };
  hooks.at_station = [&recording] { recording.operator_at_station(); };
  hooks.correct = [&recording] { recording.request_correction(); };
  page.server = std::make_unique<PageServer>(options, std::move(hooks));
  ORBITFUSE_TRY(page.server->start());
  for (const std::string& url : page.server->urls()) context.console.info("page: " + url);
  context.console.event({{"event", "page"}, {"url", page.server->url()}});
  while (o.wait_for_start && !page.started && !context.progress.cancelled())
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return context.progress.check("capture");
}

void account(Context& context, recording::Recording& recording) {
  auto streams = json::array();
  for (const StreamStatus& s : recording.status()) {
    context.console.data(fmt::format(
        "{}: {} received, {} lost ({} missing, {} rejected, {} dropped) of ids {} to {}", s.device,
        s.received, s.lost, s.missing, s.rejected, s.dropped, s.first_id, s.last_id));
    streams.push_back({{"device", s.device},
                       {"received", s.received},
                       {"lost", s.lost},
                       {"missing", s.missing},
                       {"rejected", s.rejected},
                       {"dropped", s.dropped},
                       {"first_id", s.first_id},
                       {"last_id", s.last_id}});
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

Status run(Context& context, const Options& o) {
  ORBITFUSE_ASSIGN(recording::Cameras cameras, cameras_of(o));
  if (context.common.dry_run) return rehearse(context, o, cameras);
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
  recording::Recording recording(std::move(cameras.sources), options, std::move(finder));
  Page page;
  ORBITFUSE_TRY(open_page(context, o, recording, page));
  ORBITFUSE_TRY(recording.prepare());
  for (const DeviceInfo& device : recording.devices()) {
    context.console.info(
        fmt::format("{}: {} {} {}", device.id, device.driver, device.model, device.serial));
  }
  if (options.live)
    context.console.info("recording; Enter: at the next station, n: shutter correction (NUC) now, q or Ctrl-C: stop");
  Teller teller(context, recording, options.live, o.view);
  const auto ending = recording.run(context.progress.cancel, [&] { teller.tick(); });
  account(context, recording);
  if (!ending) return tl::unexpected(ending.error());
  return {};
}

}  // namespace

Action add_capture(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  app.add_option("session", options->session,
                 "Session folder: new, or with --resume one to go on with")
      ->required();
  app.add_option("--visible", options->visible,
                 "Visible camera: DRIVER[:CAMERA][,KEY=VALUE]...; drivers are aravis (GigE Vision), v4l2 "
                 "(USB video), stills (stills:FOLDER takes photos that arrive there), replay and "
                 "synthetic");
  app.add_option("--thermal", options->thermal,
                 "Thermal camera, written alike, e.g. aravis:192.168.1.20 or stills:FOLDER for "
                 "radiometric JPEGs");
  app.add_option("--driver", options->driver,
                 "For modalities without a camera of their own, e.g. replay:FOLDER");
  app.add_option("--profiles", options->profiles,
                 "Folder of camera profiles instead of the shipped one");
  app.add_option("--seconds", options->seconds, "Stop by itself after this long; 0 = go on")
      ->check(CLI::NonNegativeNumber);
  app.add_flag("--stop-when-complete", options->stop_when_complete,
               "Stop by itself when every station is done");
  app.add_option("--guide", options->guide,
                 "auto: stations that the frames carry, else the mat; key: only the operator's "
                 "Enter key says where; off: record without stations")
      ->check(CLI::IsMember({"auto", "key", "off"}))
      ->capture_default_str();
  app.add_option("--turntable", options->turntable_deg,
                 "The object stands on a turntable: each Enter key (without keys: each photo of a "
                 "stills camera) is this many degrees further; a full turn later it is the next loop");
  app.add_option("--mat", options->mat, "The mat that lies there (orbitfuse mat): paper or foil")
      ->check(CLI::IsMember({"paper", "foil"}))
      ->capture_default_str();
  app.add_option("--mat-tags", options->mat_tags,
                 "Tags along a side of the mat, if not the default");
  app.add_option(
      "--page", options->page,
      "Serve the capture page at PORT or HOST:PORT; beyond this machine it needs a token");
  app.add_option("--token", options->token, "Token of the page instead of a random one");
  app.add_flag("--wait-for-start", options->wait_for_start,
               "Begin when start is pressed on the page")
      ->needs("--page");
  app.add_flag("--view", options->view, "Show the state as text, once a second");
  app.add_option("--spacing-deg", options->spacing_deg,
                 "Azimuth between stations; 30 if nothing else is known");
  app.add_option("--elevations-deg", options->elevations_deg,
                 "Elevation of each loop; 10 30 55 if nothing else is known");
  app.add_option("--max-edge-px", options->max_edge_px,
                 "VISIBLE THERMAL: edges blurred wider than this (Gaussian sigma, with 640 pixels "
                 "along the longer side) are no station; 1.75 3.2 if not given")
      ->expected(2)
      ->check(CLI::PositiveNumber);
  return [options](Context& context) { return run(context, *options); };
}

}  // namespace orbitfuse::cli
