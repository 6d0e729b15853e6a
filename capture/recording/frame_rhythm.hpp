// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

namespace orbitfuse {

/// The time between a camera's frames. It tells how many an outage cost, and of frames that never
/// came although the driver's count has no hole: a UVC frame that is lost whole turns no frame bit.
class FrameRhythm {
 public:
  /// Every frame, good or damaged. Returns how many more should have come since the one before,
  /// when ids follow each other but the time between them is 1.75 times the usual or longer.
  int note(std::uint64_t id, std::int64_t stamp_ns);
  /// The stream was broken: the time until the next frame says nothing.
  void interrupt() { last_.reset(); }
  /// False before two frames came: then nothing can be said of an outage.
  bool known() const { return known_ > 0; }
  /// How many frames fit into an outage; at least 1, because the frame that was under way is lost.
  std::uint64_t frames_in(double seconds) const;
  /// The same at the fastest rate that the stream ever held: a camera or host that was busy when
  /// the outage began makes frames_in() too few, and this not. At least frames_in().
  std::uint64_t most_frames_in(double seconds) const;

 private:
  /// `interval_s`, or a tenth of the mean one where that is longer: a camera or host that was busy
  /// sends what it kept back in one burst.
  double bounded_s(double interval_s) const;

  struct Seen {
    std::uint64_t id;
    std::int64_t stamp_ns;
  };
  std::optional<Seen> last_;
  double interval_s_ = 0;  ///< smoothed
  double shortest_s_ = 0;  ///< of interval_s_, since the first intervals
  double all_s_ = 0;       ///< of all intervals, and the frames' steps in them
  double all_steps_ = 0;
  int known_ = 0;  ///< intervals so far
};

}  // namespace orbitfuse
