// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "capture/frame_source.hpp"

namespace orbitfuse {

/// 16-bit thermal samples whose scale nobody knows must never be stored as temperatures. They
/// become an 8-bit picture (gray, for poses and for people) under one stretch for the whole stream,
/// and travel on as `original`, which is stored without loss. The stretch is taken from the first
/// frame with room on both sides: thermal cameras drift.
class RawCounts {
 public:
  /// `frame.pixels` is CV_16UC1. Returns the stretch in words when this frame has set it.
  std::optional<std::string> apply(Frame& frame);

 private:
  std::optional<std::pair<double, double>> range_;
};

}  // namespace orbitfuse
