// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

namespace orbitfuse::aravis {

/// What the time between two frames says of how many are missing.
struct MissedByTime {
  std::uint64_t usual = 0;  ///< at the rate of the last frames (FrameRhythm::frames_in)
  std::uint64_t most = 0;   ///< at the fastest rate of the stream (FrameRhythm::most_frames_in)
};

struct Missed {
  std::uint64_t frames = 0;
  bool by_number = false;  ///< told by the camera's own count, which went on
};

/// Frames lost between two of a camera with a break between them, by the 16-bit GVSP block ids of
/// both (absent: no frame yet; 0 is never sent). A camera that counts on tells exactly what it sent
/// meanwhile; one that began anew gives a number that is far off, or a small one: then the time
/// tells.
Missed missed_between(std::optional<std::uint16_t> last_number, std::uint16_t number,
                      const MissedByTime& by_time);

}  // namespace orbitfuse::aravis
