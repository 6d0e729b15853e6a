// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "core/session/session.hpp"

namespace orbitfuse {

/// The thermal frames of one orbit: of one camera and one size, because they share a lens.
struct OrbitFrames {
  std::vector<const FrameRecord*> stations;
  std::vector<const FrameRecord*> tracking;  ///< recorded between them, in capture order
  /// Neither: name and why it can't be placed.
  std::vector<std::pair<std::string, std::string>> left_out;
};

/// Frames with a station, of the camera that has most of them; where fewer than four have one, all
/// frames of that camera in the order of capture (at least eight). `limit`: tracking frames kept,
/// evenly spread. Errors: quality (too few).
Result<OrbitFrames> orbit_frames(const std::vector<const FrameRecord*>& frames, int limit);

/// The ways the stations may have been taken: as declared, or any even walk in their order.
std::vector<std::vector<Station>> layouts_of(const std::vector<const FrameRecord*>& stations);

}  // namespace orbitfuse
