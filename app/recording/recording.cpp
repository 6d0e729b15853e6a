// SPDX-License-Identifier: BSD-3-Clause
#include "app/recording/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <future>
#include <iterator>
#include <set>
#include <thread>

#include "capture/recording/frame_encoding.hpp"
#include "core/image/thermal_counts.hpp"
#include "core/system/utc_now.hpp"

namespace orbitfuse::recording {
namespace {

using Clock = std::chrono::steady_clock;

/// First id after everything that an earlier recording of the device counted.
std::uint64_t next_id(const Session& session, const std::string& device) {
  std::uint64_t next = 0;
  for (const FrameRecord& frame : session.frames) {
    if (frame.device == device) next = std::max(next, frame.sequence + 1);
  }
  for (const GapRecord& gap : session.gaps) {
    if (gap.device == device) next = std::max(next, gap.first_sequence + gap.count);
  }
  for (const StreamRecord& stream : session.streams) {
    if (stream.device == device) next = std::max(next, stream.last_sequence + 1);
  }
  return next;
}

bool same_camera(const DeviceInfo& known, const DeviceInfo& now) {
  // Photos tell their camera when the first one comes; the source refuses those of another.
  const bool not_known_yet = now.driver == "stills" && now.model.empty() && now.serial.empty();
  return known.modality == now.modality && known.driver == now.driver &&
         (not_known_yet || (known.model == now.model && known.serial == now.serial));
}

Earlier earlier_of(const Session& session, const DeviceInfo& device) {
  Earlier earlier{device, {}, {}, next_id(session, device.id)};
  const auto is_its = [&](const auto& record) { return record.device == device.id; };
  std::copy_if(session.frames.begin(), session.frames.end(), std::back_inserter(earlier.frames),
               is_its);
  std::copy_if(session.gaps.begin(), session.gaps.end(), std::back_inserter(earlier.gaps), is_its);
  return earlier;
}

/// Of the newest frame of the device with temperatures that can be read.
std::optional<double> stored_kelvin_per_count(const Session& session, const std::string& device) {
  for (auto frame = session.frames.rbegin(); frame != session.frames.rend(); ++frame) {
    if (frame->device != device || frame->modality != Modality::thermal || frame->thermal_is_gray)
      continue;
    if (const auto counts = read_thermal_counts(session.path_of(*frame)))
      return counts->scale.scale;
  }
  return std::nullopt;
}

}  // namespace

Status RecordingOptions::validate() const {
  if (session.empty())
    return fail(ErrorKind::usage, "session", "empty", "name the session's folder");
  if (!(seconds >= 0))
    return fail(ErrorKind::usage, "seconds", fmt::format("{}", seconds), "must be >= 0");
  return guide ? guide->validate() : Status{};
}

Status check_folder(const RecordingOptions& options) {
  ORBITFUSE_TRY(options.validate());
  Status status = options.resume ? SessionWriter::try_resume(options.session)
                                 : SessionWriter::try_create(options.session);
  if (!status && !options.resume && status.error().kind == ErrorKind::input &&
      open_session(options.session))
    status.error().remedy += ", or go on with it: --resume";
  ORBITFUSE_TRY(status);
  return check_free_space(options.session, options.min_free_bytes);
}

Recording::Recording(std::vector<std::unique_ptr<FrameSource>> sources, RecordingOptions options,
                     PositionFinder finder)
    : options_(std::move(options)), finder_(std::move(finder)) {
  for (auto& source : sources)
    sources_.push_back(std::make_shared<PreparedSource>(std::move(source)));
}

Recording::~Recording() {
  for (const auto& source : sources_) source->stop();
}

/// Each camera under a name of its own; a camera that the session knows keeps its name.
Status Recording::fit_into(const std::optional<Session>& earlier) {
  std::set<std::string> used;
  for (const auto& source : sources_) {
    DeviceInfo device = source->describe();
    std::uint64_t first_id = 0;
    for (int number = 0;; ++number) {
      // The source's own name first, then visible0, visible1, ...
      if (number > 0) device.id = fmt::format("{}{}", name(device.modality), number - 1);
      const DeviceInfo* known = earlier ? earlier->device(device.id) : nullptr;
      if (used.count(device.id) || (known && !same_camera(*known, device))) continue;
      if (known) {
        const Earlier before = earlier_of(*earlier, *known);
        const std::uint64_t next = before.next_id;
        first_id = source->resume(before) ? 0 : next;
        if (next > 0) next_ids_[device.id] = next;
        if (const auto scale = stored_kelvin_per_count(*earlier, device.id)) {
          stored_kelvin_per_count_[device.id] = *scale;
          source->store_no_finer_than(*scale);
        }
        device = *known;
      }
      break;
    }
    used.insert(device.id);
    source->fit(device.id, first_id, options_.choose_stations && !source->can_wait());
    devices_.push_back(device);
  }
  return {};
}

/// On a thread of its own: a camera that is silent can hold up its opening for ten seconds, and who
/// presses Ctrl-C meanwhile has nothing to lose. The source is then left to that thread.
Status Recording::start(const std::shared_ptr<PreparedSource>& source,
                        const std::atomic<bool>* cancel) {
  auto started = std::make_shared<std::promise<Status>>();
  std::future<Status> done = started->get_future();
  std::thread([source, started] { started->set_value(source->start()); }).detach();
  while (done.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
    if (cancel == nullptr || !*cancel) continue;
    source->abandon();
    return fail(ErrorKind::cancelled, "capture", "stopped while a camera was being opened",
                "nothing was recorded");
  }
  return done.get();
}

Status Recording::prepare(const std::atomic<bool>* cancel) {
  if (sources_.empty())
    return fail(ErrorKind::usage, "cameras", "none given", "give --visible or --thermal");
  ORBITFUSE_TRY(check_folder(options_));
  std::optional<Session> earlier;
  if (options_.resume) {
    ORBITFUSE_ASSIGN(earlier, open_session(options_.session));
  }
  for (const auto& source : sources_) ORBITFUSE_TRY(start(source, cancel));
  const std::int64_t all_run_ns = utc_now_ns();
  ORBITFUSE_TRY(fit_into(earlier));
  if (options_.resume) {
    ORBITFUSE_ASSIGN(writer_, SessionWriter::resume(options_.session));
  } else {
    ORBITFUSE_ASSIGN(writer_, SessionWriter::create(options_.session, options_.notes));
  }
  for (const auto& source : sources_) {
    if ((sources_.size() > 1 || shown_) && !source->can_wait()) source->drop_before(all_run_ns);
  }
  const std::lock_guard lock(mutex_);
  if (options_.guide) {
    guide_ = std::make_unique<LiveGuide>(*writer_, *options_.guide, finder_);
    if (earlier) guide_->resume(earlier->frames);
  }
  RecorderOptions recorder_options;
  recorder_options.min_free_bytes = options_.min_free_bytes;
  recorder_options.next_ids = next_ids_;
  recorder_options.stored_kelvin_per_count = stored_kelvin_per_count_;
  if (!options_.live) recorder_options.backpressure = Backpressure::wait;
  recorder_ = std::make_unique<Recorder>(*writer_, recorder_options);
  recorder_->on_frame = [this](const StoredFrame& frame) {
    const FrameRecord& record = frame.record;
    keep_latest({record.modality, frame.pixels, record.file, frame.scale});
    if (guide_) guide_->add(record, frame.pixels, frame.scale.scale);
  };
  return {};
}

void Recording::keep_latest(LatestFrame frame) {
  const std::lock_guard lock(latest_mutex_);
  latest_[frame.modality] = std::move(frame);
}

/// Pictures of one camera until it is over; a failure shows when the recording begins.
void Recording::show(FrameSource& source, const std::atomic<bool>& over) {
  const Modality modality = source.describe().modality;
  while (!over) {
    const Result<Delivery> delivery = source.next(std::chrono::milliseconds(100));
    if (!delivery || delivery->kind == Delivery::Kind::end) return;
    if (delivery->kind != Delivery::Kind::frame) continue;
    const auto upright = upright_frame(delivery->frame, modality, "preview");
    if (upright) {
      keep_latest({modality, upright->pixels,
                   fmt::format("before recording {}", delivery->frame.id), upright->scale});
    }
  }
}

Status Recording::show_until(const std::function<bool()>& over, const std::atomic<bool>* cancel) {
  for (const auto& source : sources_) ORBITFUSE_TRY(start(source, cancel));
  shown_ = showing_ = true;
  std::atomic<bool> stop{false};
  {
    std::vector<std::jthread> threads;
    for (const auto& source : sources_) {
      if (!source->can_wait()) threads.emplace_back([&, s = source.get()] { show(*s, stop); });
    }
    while (!over()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    stop = true;
  }
  showing_ = false;
  return {};
}

Result<Ending> Recording::run(const std::atomic<bool>* cancel, const std::function<void()>& tick) {
  std::atomic<bool> over{false}, returned{false};
  Ending ending = Ending::source_over;
  const Clock::time_point started = Clock::now();
  {
    const std::lock_guard lock(mutex_);
    started_ = started;
    running_ = true;
  }
  std::jthread supervisor([&] {
    while (!returned) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      const double seconds = std::chrono::duration<double>(Clock::now() - started).count();
      std::optional<Ending> reason;
      if (options_.seconds > 0 && seconds >= options_.seconds) reason = Ending::time_over;
      if (options_.stop_when_complete && guide_ && guide_->complete()) reason = Ending::complete;
      if (stop_ || (cancel && *cancel)) reason = Ending::stopped;
      if (reason && !over) {
        ending = *reason;
        over = true;
      }
      measure_rates();
      if (tick) tick();
    }
  });
  std::vector<FrameSource*> sources;
  for (const auto& source : sources_) sources.push_back(source.get());
  Progress progress;
  progress.cancel = &over;
  const Status status = recorder_->run(sources, progress);
  returned = true;
  supervisor.join();
  if (tick)
    tick();  // what came after the last one is told, too: a short replay is over between two
  {
    const std::lock_guard lock(mutex_);
    ended_ = Clock::now();
    running_ = false;
  }
  if (guide_) guide_->finish();
  if (!status && status.error().kind != ErrorKind::cancelled) return tl::unexpected(status.error());
  if (guide_ && guide_->error()) return tl::unexpected(*guide_->error());
  // Ctrl-C, or Stop on the page, is how a live recording ends, but it cuts a replay short.
  if (ending == Ending::stopped && !options_.live)
    return fail(ErrorKind::cancelled, "capture", "stopped by the user",
                "every frame up to here is safe; the same command with --resume goes on");
  ORBITFUSE_TRY(writer_->close());
  return ending;
}

void Recording::measure_rates() {
  const std::lock_guard lock(mutex_);
  const Clock::time_point now = Clock::now();
  const double seconds = std::chrono::duration<double>(now - rates_measured_).count();
  if (seconds < 1) return;
  for (const StreamStatus& s : recorder_->status()) {
    Rate& rate = rates_[s.device];
    if (rates_measured_ != Clock::time_point{})
      rate.hz = static_cast<double>(s.received - rate.received) / seconds;
    rate.received = s.received;
  }
  rates_measured_ = now;
}

LiveState Recording::state() const {
  const std::lock_guard lock(mutex_);
  LiveState state;
  state.session = options_.session.string();
  state.running = running_;
  state.waits_for_start = showing_;
  if (started_ != Clock::time_point{}) {
    state.elapsed_s =
        std::chrono::duration<double>((running_ ? Clock::now() : ended_) - started_).count();
  }
  state.free_bytes = free_bytes_at(options_.session).value_or(0);
  if (recorder_) state.streams = recorder_->status();
  for (const StreamStatus& s : state.streams) {
    const auto rate = rates_.find(s.device);
    state.rates_hz.push_back(rate == rates_.end() ? 0 : rate->second.hz);
  }
  if (guide_) {
    state.cameras = guide_->cameras();
    state.sectors = guide_->sectors();
    state.complete = guide_->complete();
  }
  state.warnings = warnings_of(state);
  return state;
}

std::optional<LatestFrame> Recording::latest(Modality modality) const {
  const std::lock_guard lock(latest_mutex_);
  const auto found = latest_.find(modality);
  return found == latest_.end() ? std::nullopt : std::optional(found->second);
}

namespace {

tl::unexpected<Error> not_recording(const char* asked) {
  return fail(ErrorKind::usage, asked, "nothing is being recorded", "press Start first");
}

}  // namespace

Result<std::string> Recording::request_stop() {
  const bool again = stop_.exchange(true);
  return again ? "stopping already" : running_ ? "stopping; what is recorded is safe" : "stopping";
}

Result<std::string> Recording::operator_at_station() {
  const std::lock_guard lock(mutex_);
  if (!running_) return not_recording("at the station");
  if (!guide_)
    return fail(ErrorKind::usage, "at the station", "this recording has no guide",
                "record without --guide off");
  return guide_->operator_at_station();
}

Result<std::string> Recording::request_correction() {
  if (!running_) return not_recording("shutter correction (NUC)");
  std::string asked;
  std::optional<Error> refused;
  for (const auto& source : sources_) {
    const Status status = source->request_correction();
    // A thermal camera's reason says more than that a visible one has none.
    const bool thermal = source->describe().modality == Modality::thermal;
    if (!status && (!refused || thermal)) refused = status.error();
    if (status) asked += (asked.empty() ? "" : ", ") + source->describe().id;
  }
  if (asked.empty() && refused) return tl::unexpected(*refused);
  return "shutter correction (NUC) asked of " + asked;
}

std::vector<StreamStatus> Recording::status() const {
  const std::lock_guard lock(mutex_);
  return recorder_ ? recorder_->status() : std::vector<StreamStatus>{};
}

}  // namespace orbitfuse::recording
