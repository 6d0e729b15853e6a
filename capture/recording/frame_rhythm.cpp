// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/frame_rhythm.hpp"

#include <algorithm>
#include <cmath>

#include "capture/frame_source.hpp"

namespace orbitfuse {

namespace {
constexpr int settled = 8;      // the first intervals of a stream are irregular
constexpr double late = 1.75;   // of the usual interval
constexpr double bursts = 10;   // times the mean rate
constexpr double weight = 0.1;  // a rate that changes with the light is followed in some frames

std::uint64_t frames_of(double seconds, double interval_s) {
  if (!(seconds > 0)) return 1;
  return static_cast<std::uint64_t>(std::llround(std::clamp(seconds / interval_s, 1.0, 1e9)));
}
}  // namespace

int FrameRhythm::note(std::uint64_t id, std::int64_t stamp_ns) {
  // A camera's stamp may be anything; without a time a frame tells nothing of the rhythm.
  if (stamp_ns < 0 || stamp_ns > latest_stamp_ns) return 0;
  const std::optional<Seen> before = last_;
  last_ = Seen{id, stamp_ns};
  if (!before || id <= before->id || stamp_ns <= before->stamp_ns) return 0;
  const std::uint64_t steps = id - before->id;
  const double interval_s =
      1e-9 * static_cast<double>(stamp_ns - before->stamp_ns) / static_cast<double>(steps);
  int missing = 0;
  if (steps == 1 && known_ >= settled && interval_s > late * interval_s_) {
    missing = static_cast<int>(std::clamp(std::round(interval_s / interval_s_) - 1, 1.0, 1e6));
  }
  // A pause says nothing about the rate before and after it.
  const double told_s = missing > 0 ? std::min(interval_s, late * interval_s_) : interval_s;
  interval_s_ = known_ == 0 ? interval_s : (1 - weight) * interval_s_ + weight * told_s;
  shortest_s_ = known_ < settled ? interval_s_ : std::min(shortest_s_, interval_s_);
  ++known_;
  all_s_ += told_s * static_cast<double>(steps);
  all_steps_ += static_cast<double>(steps);
  return missing;
}

double FrameRhythm::bounded_s(double interval_s) const {
  return std::max(interval_s, all_s_ / (bursts * all_steps_));
}

std::uint64_t FrameRhythm::frames_in(double seconds) const {
  return known_ > 0 ? frames_of(seconds, bounded_s(interval_s_)) : 1;
}

std::uint64_t FrameRhythm::most_frames_in(double seconds) const {
  return known_ > 0 ? frames_of(seconds, bounded_s(shortest_s_)) : 1;
}

}  // namespace orbitfuse
