// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/missed_frames.hpp"

#include <algorithm>

#include "capture/clock/clock_map.hpp"

namespace orbitfuse::aravis {

Missed missed_between(std::optional<std::uint16_t> last_number, std::uint16_t number,
                      const MissedByTime& by_time) {
  constexpr std::uint64_t half_a_round = 32767;
  constexpr std::uint16_t first_numbers = 10;
  const std::uint64_t usual = by_time.usual;
  if (!last_number || number == 0 || usual >= half_a_round) return {usual, false};
  const auto steps = static_cast<std::uint64_t>(GvspFrameCounter::steps(*last_number, number));
  if (steps == 0) return {usual, false};
  const std::uint64_t skipped = steps - 1;
  // A camera that counts on misses what it did not send while its stream was set up again, a part
  // of the outage; a new count that happens to follow the old one is further from the time it took.
  const bool small = number <= first_numbers;
  const bool began_anew = small && 4 * skipped < 3 * usual;
  // The time between the last frames tells the rate badly when camera or host were busy: the
  // fastest that the stream held bounds what came, itself bounded because a host that wakes late
  // sees frames in bursts. A number that no new count begins with may be further off.
  const std::uint64_t fastest = std::clamp(by_time.most, usual, 3 * usual);
  const std::uint64_t most = small ? fastest + fastest / 4 : std::max(2 * usual, 2 * fastest);
  if (began_anew || skipped > most + 2) return {usual, false};
  return {skipped, true};
}

}  // namespace orbitfuse::aravis
