// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "capture/live/live_guide.hpp"
#include "capture/recording/recorder.hpp"

namespace orbitfuse {

/// One moment of a recording, as the page and the terminal show it.
struct LiveState {
  std::string session;
  bool running = false, complete = false;
  double elapsed_s = 0;
  std::uint64_t free_bytes = 0;  ///< on the session's disk
  std::vector<StreamStatus> streams;
  std::vector<double> rates_hz;     ///< of `streams`
  std::vector<LiveCamera> cameras;  ///< empty without a guide
  std::vector<Sector> sectors;
  std::vector<std::string> warnings;  ///< what the operator should act on now
};

/// Warnings that follow from the figures: silence, drops, rejections, a nearly full disk.
std::vector<std::string> warnings_of(const LiveState& state);

/// What came of a stream and what was lost, and the span of its ids (null before its first frame).
nlohmann::json account_json(const StreamStatus& stream);

/// {"session","running","elapsed_s","free_bytes","streams":[...],"cameras":[...],"loops":[...],...};
/// docs/capture.md describes the fields.
std::string json_of(const LiveState& state);

/// A few lines for a terminal without graphics: one row of marks per loop (# both done, v or t one
/// of two, . none), what to do next, counters.
std::string terminal_view(const LiveState& state);

}  // namespace orbitfuse
