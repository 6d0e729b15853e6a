// SPDX-License-Identifier: BSD-3-Clause
// What happens between a camera's loss and its return, and at the end of a recording.
#include <fmt/format.h>

#include <algorithm>

#include "drivers/aravis/aravis_source.hpp"
#include "drivers/aravis/gvcp_probe.hpp"
#include "drivers/aravis/link.hpp"
#include "drivers/aravis/missed_frames.hpp"
#include "drivers/aravis/teardown.hpp"

namespace orbitfuse::aravis {
namespace {

using namespace std::chrono_literals;

/// Between looks for a lost camera: little beside the 3 s within which its frames are to come again
/// (docs/benchmarks/capture/outages.md).
constexpr auto look_every = 200ms;
/// A camera that is there answers within milliseconds.
constexpr auto look_patience = 100ms;
/// Twice what a frame's missing packets have (frame-retention in open()).
constexpr auto drain_patience = 600ms;

double seconds(std::chrono::steady_clock::duration d) {
  return std::chrono::duration<double>(d).count();
}

}  // namespace

/// Destroying a connection can block for seconds while the camera does not answer.
void AravisSource::bury_link() {
  control_watch_ = {};
  if (!link_) return;
  earlier_ += link_statistics();
  Teardowns::all().begin(address_, std::move(link_));
  link_ = nullptr;
  going_ = true;
}

Delivery AravisSource::lose(const std::string& why) {
  const bool was_streaming = state_ == State::streaming;
  bury_link();
  state_ = State::away;
  next_attempt_ = {};
  if (was_streaming) {
    rhythm_.interrupt();
    fruitless_ = 0;
    return event_delivery(EventKind::disconnected, why);
  }
  if (++fruitless_ < 2) return {};
  auto pause = options_.patience;
  for (int i = 2; i < fruitless_ && pause < options_.most_patience; ++i) pause *= 2;
  pause = std::min(pause, options_.most_patience);
  next_attempt_ = Clock::now() + pause;
  if (fruitless_ > 2) return {};
  return event_delivery(EventKind::reopen_failed,
                        fmt::format("{} was opened twice again, but no frame came ({}); next in "
                                    "{:.0f} s, then less and less often",
                                    address_, why, seconds(pause)));
}

/// Nothing to tell when it is opened: it is back with its first frame.
std::optional<Delivery> AravisSource::try_reopen() {
  if (Clock::now() < next_attempt_) return std::nullopt;
  next_attempt_ = Clock::now() + look_every;
  if (!Teardowns::all().wait(address_, 0ms)) return std::nullopt;
  if (!answers(address_, look_patience)) return std::nullopt;
  if (const Status status = open(); !status) {
    if (!failure_.note(status.error().message())) return std::nullopt;
    return event_delivery(EventKind::reopen_failed, status.error().message());
  }
  failure_.clear();
  state_ = State::proving;
  return std::nullopt;
}

/// The first frame after an outage, which comes after the event.
Delivery AravisSource::come_back(void* handle, const Arrival& arrival) {
  auto* buffer = static_cast<ArvBuffer*>(handle);
  const auto number = static_cast<std::uint16_t>(arv_buffer_get_frame_id(buffer));
  const double outage_s = seconds(arrival.at - last_came_);
  MissedByTime by_time;
  if (rhythm_.known() && last_came_ != Clock::time_point{})
    by_time = {rhythm_.frames_in(outage_s) - 1, rhythm_.most_frames_in(outage_s) - 1};
  const Missed missed = missed_between(last_number_, number, by_time);
  state_ = State::streaming;
  fruitless_ = 0;
  base_id_ = next_id_ + missed.frames;
  pending_.insert(pending_.begin(), inspect(buffer, arrival));
  return event_delivery(
      EventKind::reconnected,
      fmt::format("{} after {:.1f} s, {} frames lost {}; settings pushed and verified", address_,
                  outage_s, missed.frames,
                  missed.by_number ? "by the camera's count" : "by the time it took"));
}

/// What is under way gets the time that its missing packets have; then nothing is left uncounted.
void AravisSource::drain(std::vector<Delivery>& list) {
  if (!control_mute_ && !link_->control_lost) {
    arv_camera_stop_acquisition(link_->camera, nullptr);
    link_->stopped = true;
  }
  const auto under_way = [this] {
    gint in = 0, out = 0;
    arv_stream_get_n_buffers(link_->stream, &in, &out);
    return in + out < options_.buffers;
  };
  const auto limit = Clock::now() + drain_patience;
  while (link_) {
    ArvBuffer* buffer = arv_stream_timeout_pop_buffer(link_->stream, 20'000);
    if (!buffer && (!under_way() || Clock::now() > limit)) break;
    if (!buffer) continue;
    list.push_back(take(buffer));
    std::move(pending_.begin(), pending_.end(), std::back_inserter(list));
    pending_.clear();
  }
}

std::vector<Delivery> AravisSource::unfinished() {
  std::vector<Delivery> list = std::exchange(pending_, {});
  const Clock::time_point end = Clock::now(), last_before = last_frame_;
  if (link_) drain(list);
  const bool came = last_frame_ != last_before;  // what was under way says that the stream lived
  const bool silent = state_ != State::streaming || (!came && end - last_frame_ > options_.silence);
  if (!silent || !rhythm_.known() || last_came_ == Clock::time_point{}) return list;
  const double outage_s = seconds(end - last_came_);
  Delivery lost;
  lost.kind = Delivery::Kind::lost;
  lost.frame.id = next_id_ + rhythm_.frames_in(outage_s) - 1;
  lost.reason = fmt::format("no frame for the last {:.1f} s, counted by time", outage_s);
  list.push_back(std::move(lost));
  return list;
}

}  // namespace orbitfuse::aravis
