// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "capture/frame_source.hpp"

namespace orbitfuse::recording {

/// What one camera delivered while nothing was written.
struct Rehearsal {
  DeviceInfo device;
  std::uint64_t frames = 0, rejected = 0, missing = 0;
  double rate_hz = 0;  ///< by arrival; 0 of files, which wait
  int width = 0, height = 0;
  std::map<std::string, int> reasons;  ///< of rejections, and events
  std::map<std::string, std::string>
      details;  ///< the last event's of each reason, where it has one
};

/// Opens every camera and lets it deliver for some seconds (a finite source: at most to its end),
/// one after the other, so that a shared bus or link problem of one does not hide behind another.
Result<std::vector<Rehearsal>> rehearse(const std::vector<std::unique_ptr<FrameSource>>& sources,
                                        double seconds, const std::atomic<bool>* cancel = nullptr);

}  // namespace orbitfuse::recording
