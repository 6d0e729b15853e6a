// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "capture/frame_source.hpp"

namespace orbitfuse {

enum class ReplaySpeed { full, recorded };

/// A device of a recorded session as if it were there again: same bytes, ids, times and flags.
/// `recorded` waits as long between frames as the recording did.
std::unique_ptr<FrameSource> make_replay_source(const Session& session, const std::string& device,
                                                ReplaySpeed speed);

/// One source per device of the session.
std::vector<std::unique_ptr<FrameSource>> make_replay_sources(const Session& session,
                                                              ReplaySpeed speed);

}  // namespace orbitfuse
