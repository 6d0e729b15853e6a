// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include "core/session/session.hpp"

namespace orbitfuse {

/// Ids of a device's stream that no line of its manifest stands for, neither a frame nor a gap. A
/// recorder writes one of both for every id, so that these are lines that were removed since, or
/// never reached a disk that lied.
struct LostLines {
  std::string device;
  std::uint64_t first_sequence = 0, count = 0;  ///< the first of them; of all
};

/// Of every device that has any. Frames whose files are missing have their lines: call this before
/// they are taken out of the session.
std::vector<LostLines> lost_lines(const Session& session);

}  // namespace orbitfuse
