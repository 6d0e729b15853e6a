// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "core/modality.hpp"
#include "core/image/palette.hpp"
#include "core/result.hpp"

namespace orbitfuse {

struct Preview {
  std::string jpeg;
  std::optional<TemperatureSpan> span;  ///< thermal with temperatures only
};

/// Small pictures of the newest frames, read back from disk. One camera's frame is read and encoded
/// at most five times a second whatever the number of viewers, so that they cost no frame.
class PreviewCache {
 public:
  /// `file`: a recorded frame. `span`: locked by the viewer; else this frame's own.
  Result<Preview> get(const std::filesystem::path& file, Modality modality,
                      const std::string& palette_name, std::optional<TemperatureSpan> span);
  /// At a place given as shares of width and height; nothing without a temperature there.
  std::optional<double> kelvin_at(const std::filesystem::path& file, double u, double v);

 private:
  using Clock = std::chrono::steady_clock;
  struct Entry {
    Preview preview;
    Clock::time_point made;
  };
  struct Kelvin {
    std::filesystem::path file;
    cv::Mat image;
    Clock::time_point made;
  };
  std::mutex mutex_;
  std::map<std::string, Entry> entries_;
  Kelvin kelvin_;
};

}  // namespace orbitfuse
