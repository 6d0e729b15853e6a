// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "capture/frame_source.hpp"

namespace orbitfuse::recording {

/// A source made fit for a session. It is started before the session's folder is made, so that a
/// camera that is absent, taken or forbidden leaves nothing behind, and so that its model and
/// serial are known when it is announced. Ids go on where the device's earlier recording ended.
class PreparedSource final : public FrameSource {
 public:
  explicit PreparedSource(std::unique_ptr<FrameSource> source) : source_(std::move(source)) {}

  DeviceInfo describe() const override;
  Status start() override;
  Result<Delivery> next(std::chrono::milliseconds timeout) override;
  /// Its start() hangs: the thread that is in it has it now, and stop() does nothing.
  void abandon() { abandoned_ = true; }
  void stop() override;
  bool can_wait() const override { return source_->can_wait(); }
  Status request_correction() override { return source_->request_correction(); }
  std::string transport_report() const override { return source_->transport_report(); }
  std::vector<Delivery> unfinished() override;
  bool resume(const Earlier& earlier) override { return source_->resume(earlier); }
  void store_no_finer_than(double kelvin_per_count) override {
    source_->store_no_finer_than(kelvin_per_count);
  }

  /// Cameras start one after the other, and the first one's queue fills meanwhile. Leaves out what
  /// lies there from between its start and `all_run_ns` (UTC, by the frames' own times) and tells
  /// it by an event "stale"; ids count from the first frame that is kept. Before the first next().
  void drop_before(std::int64_t all_run_ns);
  /// The session's name for the device, its first id, and whether frames are tracking frames until
  /// the guide chooses them. Before the first next().
  void fit(std::string device_id, std::uint64_t first_id, bool tracking);

 private:
  void renumber(Delivery& delivery);

  std::unique_ptr<FrameSource> source_;
  std::deque<Result<Delivery>> waiting_;  ///< delivered before what the source has next
  std::atomic<bool> abandoned_ = false;
  bool started_ = false, tracking_ = false;
  std::optional<std::string> device_id_;
  std::int64_t started_ns_ = 0;  ///< UTC
  std::uint64_t first_id_ = 0;
  std::optional<std::uint64_t> source_first_id_;
};

}  // namespace orbitfuse::recording
