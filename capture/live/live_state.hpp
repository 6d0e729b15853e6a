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
  bool waits_for_start = false;  ///< the cameras are shown, but nothing is recorded yet
  double elapsed_s = 0;
  std::uint64_t free_bytes = 0;  ///< on the session's disk
  std::vector<StreamStatus> streams;
  std::vector<double> rates_hz;     ///< of `streams`
  std::vector<LiveCamera> cameras;  ///< empty without a guide
  std::vector<Sector> sectors;
  std::vector<std::string> warnings;  ///< what the operator should act on now
};

/// What keeps the operator from going on: cameras that are away or silent while it runs. In words
/// that change with the seconds.
std::vector<std::string> alarms_of(const LiveState& state);

/// Warnings that follow from the figures: drops, rejections, a nearly full disk, alarms.
std::vector<std::string> warnings_of(const LiveState& state);

/// The same in words: "90 received, 10 lost (5 missing, 3 rejected, 2 dropped)".
std::string account_words(const StreamStatus& stream);
/// "3 frames arrived damaged and count as lost, last IMG_4.jpg: not a JPEG". There is one.
std::string damaged_words(const StreamStatus& stream);

/// What came of a stream and what was lost, and the span of its ids (null before its first frame).
nlohmann::json account_json(const StreamStatus& stream);

/// {"session","running","elapsed_s","free_bytes","streams":[...],"cameras":[...],"loops":[...],...};
/// docs/capture.md describes the fields.
std::string json_of(const LiveState& state);

/// A few lines for a terminal without graphics: one row of marks per loop (# both done, v or t one
/// of two, . none), what to do next, counters.
std::string terminal_view(const LiveState& state);

}  // namespace orbitfuse
