// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/session/session.hpp"

// Frames recorded between the stations carry no station of their own, but an order: with the
// stations posed, it says where each was taken to a few degrees.
namespace orbitfuse {

/// A posed station on the way round: its place in the stream, and where it was found.
struct PassedStation {
  std::uint64_t sequence = 0;
  Station station;
  double azimuth_deg = 0;  ///< found, in the canonical world
};

/// Stations, as refine_orbit takes them, for tracking frames (ascending sequence). Frames among the
/// stations' sequence lie between their neighbours, in proportion; frames of a stream of their own,
/// before or after all stations, are spread evenly over the same loops. `offset_deg`: azimuth less
/// nominal azimuth, as the stations were found.
std::vector<Station> stations_between(const std::vector<PassedStation>& passed,
                                      const std::vector<std::uint64_t>& tracking, bool clockwise,
                                      double offset_deg);

/// At most `limit` of the frames, evenly chosen.
std::vector<const FrameRecord*> thinned(const std::vector<const FrameRecord*>& frames, int limit);

}  // namespace orbitfuse
