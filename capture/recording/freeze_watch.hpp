// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "capture/frame_source.hpp"

namespace orbitfuse {

/// Tells when a thermal camera's shutter is closed (NUC, FFC): a thermal sensor never repeats its
/// noise, so equal samples mean that the picture is frozen. Cameras that send each picture of a
/// slow sensor several times (9 Hz at 60 Hz) are learnt: repeats no longer than the longest one of
/// up to 150 ms are theirs.
class FreezeWatch {
 public:
  using Clock = std::chrono::steady_clock;
  /// Frames still drift for `settle` after a freeze.
  explicit FreezeWatch(std::chrono::milliseconds settle) : settle_(settle) {}

  /// Flags the frame "nuc" during a freeze and until it has settled. True when a freeze begins.
  bool mark(Frame& frame, const void* samples, std::size_t size,
            Clock::time_point now = Clock::now());
  /// A correction was asked for: frames are flagged from now on until it has settled.
  void expect(Clock::time_point now = Clock::now()) { until_ = now + settle_; }

 private:
  std::chrono::milliseconds settle_;
  std::uint64_t hash_ = 0;
  Clock::time_point first_{}, last_{},
      until_{};  ///< of the frames that are equal; end of the flags
  Clock::duration usual_repeat_{};
  bool frozen_ = false;
};

}  // namespace orbitfuse
