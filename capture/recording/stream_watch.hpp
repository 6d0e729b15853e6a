// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/frame_source.hpp"
#include "capture/recording/recorder.hpp"

namespace orbitfuse {

/// What an operator is told of one camera's stream beside its account: outages, silence, events
/// that ask for a hand. Not thread-safe.
class StreamWatch {
 public:
  using Clock = std::chrono::steady_clock;

  /// Of every delivery, as it comes. `silence`: how long without a frame counts as silent;
  /// `source_waits`: its frames come when they come (files).
  void see(const Delivery& delivery, std::chrono::milliseconds silence, bool source_waits);
  /// Of what came after the stream had ended: no silence any more.
  void note(const Delivery& delivery);
  /// Of a frame that came damaged and is counted so.
  void reject(std::string why) { rejected_last_ = std::move(why); }
  /// Nobody listens to the source from now on.
  void end() { over_at_ = Clock::now(); }

  /// The outage that the camera has not come back from.
  std::optional<Absence> away() const;
  /// Fills what is known here: silent, away, passed over, rejected last, repeated, notice,
  /// correction.
  void tell(StreamStatus& status) const;

 private:
  struct Outage {
    Clock::time_point since;
    std::string why;
  };

  bool silent_ = false;
  std::optional<Outage> outage_;
  std::optional<Clock::time_point> over_at_;
  Clock::time_point last_frame_ = Clock::now();
  std::string notice_, correction_, rejected_last_;
  std::uint64_t passed_over_ = 0, repeated_ = 0, corrections_ = 0;
  std::vector<std::string> passed_over_last_;
};

}  // namespace orbitfuse
