// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "capture/recording/latest_frame.hpp"
#include "core/image/palette.hpp"
#include "core/result.hpp"

namespace orbitfuse {

struct Preview {
  std::string jpeg;
  std::optional<TemperatureSpan> span;  ///< thermal with temperatures only
};

/// Small pictures of the newest frames, which were decoded already. One camera's frame is encoded
/// at most five times a second whatever the number of viewers, so that they cost no frame.
class PreviewCache {
 public:
  /// `span`: locked by the viewer; else this frame's own.
  Result<Preview> get(const LatestFrame& frame, const std::string& palette_name,
                      std::optional<TemperatureSpan> span);

 private:
  using Clock = std::chrono::steady_clock;
  struct Entry {
    Preview preview;
    Clock::time_point made;
  };
  std::mutex mutex_;
  std::map<std::string, Entry> entries_;
};

/// At a place given as shares of width and height; nothing without a temperature there.
std::optional<double> kelvin_at(const LatestFrame& frame, double u, double v);

}  // namespace orbitfuse
