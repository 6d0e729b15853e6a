// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace orbitfuse::bench {

struct Checked {
  std::uint64_t frames = 0, lost = 0;
  bool complete = false;                ///< its last line is an end
  std::vector<std::string> violations;  ///< empty: all is as it must be
};

/// Reads a session without the program's own reader: every id of every device is a frame's or in a
/// gap, exactly once and without a hole; each stream line's figures are those of its lines; every
/// frame's file is there and can be read; thermal frames hold, bit by bit, one frame of the camera
/// simulator. `killed`: the last line may be cut.
Checked check_session(const std::filesystem::path& folder, bool killed);

}  // namespace orbitfuse::bench
