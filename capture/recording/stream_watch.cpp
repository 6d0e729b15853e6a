// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/stream_watch.hpp"

namespace orbitfuse {
namespace {

/// What the operator should look into until the camera is back.
bool asks_for_operator(EventKind kind) {
  switch (kind) {
    case EventKind::moved:
    case EventKind::twin:
    case EventKind::look_alike:
    case EventKind::reopen_failed:
    case EventKind::setting_lost:
    case EventKind::nothing_new:
    case EventKind::transparent:
    case EventKind::held:
      return true;
    default:
      return false;
  }
}

bool loses_stream(EventKind kind) {
  return kind == EventKind::disconnected || kind == EventKind::stalled || kind == EventKind::twin;
}

}  // namespace

void StreamWatch::see(const Delivery& delivery, std::chrono::milliseconds silence,
                      bool source_waits) {
  note(delivery);
  // A timeout alone is no silence: one damaged frame holds up those behind it.
  const Delivery::Kind kind = delivery.kind;
  if (kind == Delivery::Kind::frame || kind == Delivery::Kind::rejected) last_frame_ = Clock::now();
  // Files come when they come, unless their folder is gone.
  silent_ = kind == Delivery::Kind::timeout && Clock::now() - last_frame_ > silence &&
            (!source_waits || outage_);
}

void StreamWatch::note(const Delivery& delivery) {
  if (delivery.kind != Delivery::Kind::event) return;
  if (asks_for_operator(delivery.event)) notice_ = delivery.detail;
  if (loses_stream(delivery.event)) outage_ = Outage{last_frame_, delivery.detail};
  switch (delivery.event) {
    case EventKind::ignored:
    case EventKind::duplicate: {
      if (delivery.kept) {  // it is in the count of frames
        notice_ = delivery.detail;
        break;
      }
      constexpr std::size_t shown = 3;
      ++passed_over_;
      if (passed_over_last_.size() == shown) passed_over_last_.erase(passed_over_last_.begin());
      passed_over_last_.push_back(delivery.detail);
      break;
    }
    case EventKind::repeated_id:
      ++repeated_;
      break;
    case EventKind::reconnected:
      notice_.clear();
      outage_.reset();
      break;
    case EventKind::nuc:
    case EventKind::nuc_failed:
      correction_ = (delivery.event == EventKind::nuc ? "shutter correction (NUC): "
                                                      : "no shutter correction (NUC): ") +
                    delivery.detail;
      ++corrections_;
      break;
    default:
      break;
  }
}

std::optional<Absence> StreamWatch::away() const {
  if (!outage_) return std::nullopt;
  const std::chrono::duration<double> lasted = over_at_.value_or(Clock::now()) - outage_->since;
  return Absence{lasted.count(), outage_->why};
}

void StreamWatch::tell(StreamStatus& status) const {
  status.silent = silent_;
  status.away = away();
  status.passed_over = passed_over_;
  status.passed_over_last = passed_over_last_;
  status.rejected_last = rejected_last_;
  status.repeated = repeated_;
  status.notice = notice_;
  status.correction = correction_;
  status.corrections = corrections_;
}

}  // namespace orbitfuse
