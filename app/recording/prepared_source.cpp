// SPDX-License-Identifier: BSD-3-Clause
#include "app/recording/prepared_source.hpp"

#include <fmt/format.h>

#include "core/system/utc_now.hpp"

namespace orbitfuse::recording {

DeviceInfo PreparedSource::describe() const {
  DeviceInfo info = source_->describe();
  if (device_id_) info.id = *device_id_;
  return info;
}

Status PreparedSource::start() {
  if (started_) return {};
  started_ns_ = utc_now_ns();
  ORBITFUSE_TRY(source_->start());
  started_ = true;
  return {};
}

Result<Delivery> PreparedSource::next(std::chrono::milliseconds timeout) {
  Result<Delivery> delivery = Delivery{};
  if (waiting_.empty()) {
    delivery = source_->next(timeout);
  } else {
    delivery = std::move(waiting_.front());
    waiting_.pop_front();
  }
  if (delivery) renumber(*delivery);
  return delivery;
}

std::vector<Delivery> PreparedSource::unfinished() {
  std::vector<Delivery> list = source_->unfinished();
  for (Delivery& delivery : list) renumber(delivery);
  return list;
}

void PreparedSource::renumber(Delivery& delivery) {
  if (delivery.kind != Delivery::Kind::frame && delivery.kind != Delivery::Kind::rejected &&
      delivery.kind != Delivery::Kind::lost)
    return;
  std::uint64_t& id = delivery.frame.id;
  // Without an earlier recording ids stay the device's own.
  if (first_id_ > 0) {
    if (!source_first_id_) source_first_id_ = id;
    id = first_id_ + (id - *source_first_id_);
  }
  if (tracking_) delivery.frame.tracking = true;
}

void PreparedSource::drop_before(std::int64_t all_run_ns) {
  constexpr std::size_t longest_queue =
      4096;  // a source that never runs dry is not drained for ever
  std::uint64_t dropped = 0;
  // A rejected frame may have no time: it is stale if a stale one follows, else it counts as
  // rejected.
  std::deque<Result<Delivery>> undecided;
  for (bool over = false; !over && undecided.size() < longest_queue;) {
    Result<Delivery> delivery = source_->next(std::chrono::milliseconds(0));
    if (delivery && delivery->kind == Delivery::Kind::timeout) break;
    const bool stale =
        delivery && delivery->kind == Delivery::Kind::frame && delivery->frame.host_time_ns &&
        *delivery->frame.host_time_ns >= started_ns_ && *delivery->frame.host_time_ns < all_run_ns;
    if (stale) {
      const auto rejected = [](const auto& d) { return d && d->kind == Delivery::Kind::rejected; };
      dropped += 1 + static_cast<std::uint64_t>(std::erase_if(undecided, rejected));
      continue;
    }
    over = !delivery || delivery->kind == Delivery::Kind::frame;
    undecided.push_back(std::move(delivery));
  }
  for (Result<Delivery>& delivery : undecided) waiting_.push_back(std::move(delivery));
  if (dropped == 0) return;
  waiting_.push_front(
      event_delivery(EventKind::stale,
                     fmt::format("{} frames from before all cameras ran were left out", dropped)));
}

void PreparedSource::stop() {
  if (abandoned_) return;
  source_->stop();
  started_ = false;
}

void PreparedSource::fit(std::string device_id, std::uint64_t first_id, bool tracking) {
  device_id_ = std::move(device_id);
  first_id_ = first_id;
  tracking_ = tracking;
}

}  // namespace orbitfuse::recording
