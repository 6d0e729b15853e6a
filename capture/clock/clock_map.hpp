// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace orbitfuse {

struct ClockMapOptions {
  double window_s = 60;  ///< short enough to follow a drift that changes with warmth
  double jump_s = 0.1;   ///< more than any queueing delay of a working link
  int jump_frames = 3;   ///< a single late frame is no jump
};

/// Device clock to host clock. Arrival stamps are late by a varying, never negative delay, so the
/// line host = offset + rate * device is fitted to the earliest arrivals (lower envelope). Clock
/// steps in either direction start a new fit and are told. Host times never go back.
class ClockMap {
 public:
  explicit ClockMap(ClockMapOptions options = {});

  struct Stamp {
    std::int64_t host_time_ns = 0;     ///< when the frame was taken, host clock, strictly rising
    std::optional<std::string> event;  ///< "clock jumped by -3.200 s"
  };
  /// One frame: its device stamp, if it has one (cameras send 0 for none, and what is negative or
  /// beyond 146 years is no stamp either), and the host time at arrival.
  Stamp add(std::optional<std::int64_t> device_stamp_ns, std::int64_t arrival_ns);

  double drift_ppm() const { return (rate_ - 1.0) * 1e6; }
  /// Host minus device time at the latest frame.
  double offset_s() const;
  /// Root mean square of the fit at the frames it rests on, seconds.
  double residual_rms_s() const { return residual_rms_s_; }
  int jumps() const { return jumps_; }

 private:
  struct Sample {
    double device_s, arrival_s;  ///< since the segment's first frame
  };
  void begin_segment(std::int64_t device_ns, std::int64_t arrival_ns);
  void fit();
  std::int64_t host_of(double device_s) const;
  double predicted_s(double device_s) const { return intercept_s_ + rate_ * device_s; }

  ClockMapOptions options_;
  std::deque<Sample> samples_;
  std::vector<std::pair<std::int64_t, std::int64_t>> suspects_;
  std::int64_t device_origin_ns_ = 0, host_origin_ns_ = 0, last_device_ns_ = 0, last_host_ns_ = 0;
  double intercept_s_ = 0, rate_ = 1, residual_rms_s_ = 0;
  int jumps_ = 0;
};

/// Frame numbers of GigE Vision streams: 16 bits, 65535 is followed by 1, 0 is never sent.
/// Returns a count without wraps in which gaps are lost frames; nullopt for 0 and for a frame
/// that repeats or comes late.
class GvspFrameCounter {
 public:
  std::optional<std::uint64_t> unwrap(std::uint16_t frame_id);
  void restart() { last_.reset(); }  ///< after the stream was opened again
  /// From one number forward to the other on the circle 1..65535; 0: the same.
  static int steps(std::uint16_t from, std::uint16_t to) {
    return (static_cast<int>(to) - static_cast<int>(from) + 65535) % 65535;
  }

 private:
  std::optional<std::uint16_t> last_;
  std::uint64_t next_ = 0;
};

}  // namespace orbitfuse
