// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/recorder.hpp"

#include <fmt/format.h>

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <thread>
#include <variant>

#include "capture/recording/stream_account.hpp"
#include "capture/recording/stream_watch.hpp"
#include "core/option_range.hpp"
#include "core/system/utc_now.hpp"
#include "core/temperature.hpp"

namespace orbitfuse {
namespace {

using Loss = StreamAccount::Loss;

constexpr const char* when_full =
    "free disk space and resume the session; every frame acknowledged is safe";

std::optional<std::uint64_t> next_id_in(const RecorderOptions& options, const std::string& device) {
  const auto found = options.next_ids.find(device);
  return found == options.next_ids.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

/// One camera. The capture thread pushes, the writer thread pops; the queue bounds memory.
struct Recorder::Channel {
  Channel(FrameSource& s, SessionWriter& w, const RecorderOptions& o, const Progress& p,
          const OnFrame& f)
      : source(s),
        writer(w),
        options(o),
        progress(p),
        on_frame(f),
        device(s.describe()),
        account(device.id, next_id_in(o, device.id)) {
    if (const auto known = o.stored_kelvin_per_count.find(device.id);
        known != o.stored_kelvin_per_count.end())
      kelvin_per_count = known->second;
  }

  FrameSource& source;
  SessionWriter& writer;
  const RecorderOptions& options;
  const Progress& progress;
  const OnFrame& on_frame;
  DeviceInfo device;  ///< changed by the writer thread only
  StreamAccount account;

  std::mutex mutex;
  std::condition_variable changed;
  /// What came, in its order; only frames count for the bound, because events are small.
  using Item = std::variant<Frame, EventRecord>;
  std::deque<Item> queue;
  std::size_t frames_queued = 0;
  bool capture_over = false;
  bool writer_failed = false;
  std::deque<GapRecord> untold_gaps;             ///< taken from the account, in no line yet
  std::optional<std::uint64_t> first_unwritten;  ///< the frame at which the writer failed
  StreamWatch watch;
  std::optional<Error> error;
  std::optional<FrameRecord> latest;
  double kelvin_per_count = kelvin_per_dn;  ///< of the newest stored temperatures

  bool stopping() {
    const std::lock_guard lock(mutex);
    return writer_failed || progress.cancelled();
  }

  /// Nothing of such a source is lost for being late, nor when the recording stops.
  bool source_waits() const {
    return options.backpressure == Backpressure::wait || source.can_wait();
  }

  void keep_first(const Error& e) {
    const std::lock_guard lock(mutex);
    if (!error) error = e;
  }

  /// Written by the writer thread: a slow disk must not hold up the capture thread.
  void log_event(EventKind kind, const std::string& detail) {
    const std::lock_guard lock(mutex);
    queue.push_back(EventRecord{device.id, utc_now_ns(), std::string(name(kind)), detail});
    changed.notify_all();
  }

  void reject(std::uint64_t id, const std::string& why) {
    account.lose(id, Loss::rejected, rejected_because + why);
    const std::lock_guard lock(mutex);
    watch.reject(why);
  }

  void push(Frame frame) {
    std::unique_lock lock(mutex);
    const auto has_room = [&] {
      return frames_queued < static_cast<std::size_t>(options.queue_frames) || writer_failed;
    };
    // Also when the recording is being stopped: the writer still writes what is queued.
    if (source_waits()) changed.wait(lock, has_room);
    if (!has_room() || writer_failed) {
      if (writer_failed)
        account.lose(frame.id, Loss::unwritten, "not written");
      else
        account.lose(frame.id, Loss::dropped, "dropped: the disk is too slow");
      return;
    }
    queue.push_back(std::move(frame));
    ++frames_queued;
    changed.notify_all();
  }

  void take(Delivery delivery) {
    switch (delivery.kind) {
      case Delivery::Kind::frame:
      case Delivery::Kind::rejected: {
        const std::uint64_t id = delivery.frame.id;
        if (!account.see(id)) {
          log_event(EventKind::out_of_order, fmt::format("frame {} after a later one", id));
        } else if (delivery.kind == Delivery::Kind::frame) {
          push(std::move(delivery.frame));
        } else {
          reject(id, delivery.reason);
        }
        break;
      }
      case Delivery::Kind::lost:
        account.miss_until(delivery.frame.id, delivery.reason);
        break;
      case Delivery::Kind::event:
        log_event(delivery.event, delivery.detail);
        break;
      case Delivery::Kind::timeout:
      case Delivery::Kind::end:
        break;
    }
  }

  void capture() {
    Status status = source.start();
    const bool started = status.has_value();
    bool ended_by_itself = false;
    while (status && !stopping()) {
      Result<Delivery> delivery = source.next(options.next_timeout);
      if (!delivery) {
        status = tl::unexpected(delivery.error());
        break;
      }
      {
        const std::lock_guard lock(mutex);
        watch.see(*delivery, options.silence, source.can_wait());
      }
      if (delivery->kind == Delivery::Kind::end) {
        ended_by_itself = true;
        break;
      }
      take(*std::move(delivery));
    }
    for (Delivery& late : started ? source.unfinished() : std::vector<Delivery>{}) {
      {
        const std::lock_guard lock(mutex);
        watch.note(late);
      }
      take(std::move(late));
    }
    if (const std::string counted = source.transport_report(); !counted.empty())
      log_event(EventKind::transport, counted);
    {
      const std::lock_guard lock(mutex);
      watch.end();
    }
    source.stop();
    if (status && !ended_by_itself) status = expect_stream();
    if (!status) {
      keep_first(status.error());
      log_event(EventKind::stream_error, status.error().message());
    }
    const std::lock_guard lock(mutex);
    capture_over = true;
    changed.notify_all();
  }

  /// When a recording is stopped: whether the camera still is there.
  Status expect_stream() {
    const std::lock_guard lock(mutex);
    if (const std::optional<Absence> away = watch.away()) {
      return fail(ErrorKind::device, device.id,
                  fmt::format("away for the last {:.1f} s ({})", away->seconds, away->why),
                  "what is recorded is safe; check its power and cable, then go on with --resume");
    }
    if (source_waits() || account.counts().any || writer_failed) return {};
    return fail(ErrorKind::device, device.id, "not one frame came",
                "check the camera (orbitfuse doctor), then go on with --resume");
  }

  std::optional<Item> pop() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return !queue.empty() || capture_over; });
    if (queue.empty()) return std::nullopt;
    Item item = std::move(queue.front());
    queue.pop_front();
    frames_queued -= std::holds_alternative<Frame>(item);
    changed.notify_all();
    return item;
  }

  /// Some sources know their camera only from its first frame.
  void tell_what_is_known() {
    DeviceInfo now = source.describe();
    if (now.model == device.model && now.serial == device.serial &&
        now.lens.focal_px == device.lens.focal_px)
      return;
    device.model = std::move(now.model);
    device.serial = std::move(now.serial);
    device.lens = now.lens;
    if (const Status s = writer.update_device(device); !s) keep_first(s.error());
  }

  /// Programs that compare counts of neighbouring frames must know. Written by the writer thread.
  void tell_scale(const StoredFrame& stored) {
    if (stored.record.modality != Modality::thermal || stored.record.thermal_is_gray ||
        stored.scale.scale == kelvin_per_count)
      return;
    const EventRecord event{
        device.id, utc_now_ns(), std::string(name(EventKind::scale)),
        fmt::format("from {} on thermal files hold {:g} K a count (before: {:g}): up to {:.0f} C",
                    stored.record.file, stored.scale.scale, kelvin_per_count,
                    celsius_from_kelvin(65535 * stored.scale.scale + stored.scale.offset))};
    kelvin_per_count = stored.scale.scale;
    if (const Status s = writer.append(event); !s) keep_first(s.error());
  }

  void store(const Frame& frame) {
    if (const Status space = check_free_space(writer.folder(), options.min_free_bytes, when_full);
        !space) {
      return give_up(frame, space.error());
    }
    tell_what_is_known();
    const Result<StoredFrame> stored = writer.store(device.id, frame);
    if (!stored && stored.error().kind == ErrorKind::input) {
      const std::string file = std::filesystem::path(frame.source).filename().string();
      reject(frame.id, (file.empty() ? "" : file + ": ") + stored.error().found);
      return;
    }
    if (!stored) return give_up(frame, stored.error());
    account.receive();
    tell_scale(*stored);
    {
      const std::lock_guard lock(mutex);
      latest = stored->record;
    }
    if (on_frame) on_frame(*stored);
  }

  void give_up(const Frame& frame, const Error& cause) {
    account.lose(frame.id, Loss::unwritten, "not written");
    first_unwritten = frame.id;
    keep_first(cause);
    const std::lock_guard lock(mutex);
    writer_failed = true;
    changed.notify_all();
  }

  /// What a full disk refuses is written once it takes a line again.
  Status write_gaps(std::optional<std::uint64_t> frame_id) {
    for (GapRecord& gap : account.take_gaps(frame_id)) untold_gaps.push_back(std::move(gap));
    for (; !untold_gaps.empty(); untold_gaps.pop_front())
      ORBITFUSE_TRY(writer.append(untold_gaps.front()));
    return {};
  }

  /// A source that waits has the frames that were not written still, and delivers them again.
  void leave_for_resuming() {
    const std::uint64_t before = account.counts().lost();
    account.forget_from(*first_unwritten);
    const EventRecord event{
        device.id, utc_now_ns(), std::string(name(EventKind::unwritten)),
        fmt::format("{} frames are left for --resume", before - account.counts().lost())};
    if (const Status s = writer.append(event); !s) keep_first(s.error());
  }

  void write() {
    while (std::optional<Item> item = pop()) {
      const Frame* frame = std::get_if<Frame>(&*item);
      if (!frame) {
        if (const Status s = writer.append(std::get<EventRecord>(*item)); !s) keep_first(s.error());
      } else if (writer_failed) {
        account.lose(frame->id, Loss::unwritten, "not written");
      } else if (const Status told = write_gaps(frame->id); !told) {
        give_up(*frame,
                told.error());  // wherever the manifest ends, it accounts for ids up to there
      } else {
        store(*frame);
      }
    }
    if (first_unwritten && source_waits()) leave_for_resuming();
    if (const Status told = write_gaps(std::nullopt); !told) keep_first(told.error());
    if (!account.counts().any) return;
    if (const Status s = writer.append(account.record()); !s) keep_first(s.error());
  }

  StreamStatus status() {
    const StreamAccount::Counts c = account.counts();
    const std::lock_guard lock(mutex);
    StreamStatus s;
    s.device = device.id;
    s.modality = device.modality;
    s.received = c.received;
    s.lost = c.lost();
    s.first_id = c.first;
    s.last_id = c.last;
    s.missing = c.missing;
    s.rejected = c.rejected;
    s.dropped = c.dropped;
    s.unwritten = c.unwritten;
    s.ended = capture_over && queue.empty();
    watch.tell(s);
    s.latest = latest;
    return s;
  }
};

Status RecorderOptions::validate() const {
  const OptionCheck check("recorder");
  ORBITFUSE_TRY(check("queue_frames", queue_frames, from_to(1, 100000)));
  ORBITFUSE_TRY(check("next_timeout", static_cast<double>(next_timeout.count()), at_least(1)));
  return check("silence", static_cast<double>(silence.count()), at_least(0));
}

Recorder::Recorder(SessionWriter& writer, RecorderOptions options)
    : writer_(writer), options_(std::move(options)) {}

Status Recorder::run(const std::vector<FrameSource*>& sources, const Progress& progress) {
  ORBITFUSE_TRY(options_.validate());
  ORBITFUSE_TRY(check_free_space(writer_.folder(), options_.min_free_bytes, when_full));
  std::vector<std::shared_ptr<Channel>> channels;
  for (FrameSource* source : sources) {
    channels.push_back(std::make_shared<Channel>(*source, writer_, options_, progress, on_frame));
    ORBITFUSE_TRY(writer_.add_device(channels.back()->device));
  }
  {
    const std::lock_guard lock(mutex_);
    channels_ = channels;
  }
  {
    std::vector<std::jthread> threads;
    for (const auto& channel : channels) {
      threads.emplace_back([channel] { channel->capture(); });
      threads.emplace_back([channel] { channel->write(); });
    }
  }
  for (const auto& channel : channels) {
    if (channel->error) return tl::unexpected(*channel->error);
  }
  return progress.check("record");
}

std::vector<StreamStatus> Recorder::status() const {
  const std::lock_guard lock(mutex_);
  std::vector<StreamStatus> out;
  for (const auto& channel : channels_) out.push_back(channel->status());
  return out;
}

}  // namespace orbitfuse
