// SPDX-License-Identifier: BSD-3-Clause
#include "app/recording/prepared_source.hpp"

namespace orbitfuse::recording {

DeviceInfo PreparedSource::describe() const {
  DeviceInfo info = source_->describe();
  if (device_id_) info.id = *device_id_;
  return info;
}

Status PreparedSource::start() {
  if (started_) return {};
  ORBITFUSE_TRY(source_->start());
  started_ = true;
  return {};
}

Result<Delivery> PreparedSource::next(std::chrono::milliseconds timeout) {
  Result<Delivery> delivery = source_->next(timeout);
  if (!delivery) return delivery;
  if (delivery->kind != Delivery::Kind::frame && delivery->kind != Delivery::Kind::rejected)
    return delivery;
  std::uint64_t& id = delivery->frame.id;
  // Without an earlier recording ids stay the device's own.
  if (first_id_ > 0) {
    if (!source_first_id_) source_first_id_ = id;
    id = first_id_ + (id - *source_first_id_);
  }
  if (tracking_) delivery->frame.tracking = true;
  return delivery;
}

void PreparedSource::stop() {
  source_->stop();
  started_ = false;
}

void PreparedSource::fit(std::string device_id, std::uint64_t first_id, bool tracking) {
  device_id_ = std::move(device_id);
  first_id_ = first_id;
  tracking_ = tracking;
}

}  // namespace orbitfuse::recording
