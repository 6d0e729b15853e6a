// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/frame_source.hpp"
#include "core/temperature.hpp"

namespace orbitfuse {

/// What the 16-bit samples of a live camera are in kelvin. A sample at the end of the camera's
/// scale means "that hot or hotter": stored as a temperature it would lie, so it becomes a dead
/// pixel, and that is told.
class ThermalSamples {
 public:
  /// T[K] = kelvin_per_sample * sample: samples are stored as they are, at the camera's own scale.
  static ThermalSamples linear(double kelvin_per_sample);
  /// Kelvin of each of the 65536 samples, NaN: none. Frames are stored at the finest scale that
  /// holds the hottest sample up to now: neighbours in different scales would differ for programs
  /// that compare counts, so a scale once taken stays.
  static ThermalSamples table(std::vector<double> kelvin);

  /// `frame.pixels` is CV_16UC1; `full_scale` the highest sample of the camera's format. Returns
  /// words about samples without a temperature for the first frame that has some, which end with
  /// `remedy`, what to do with such a camera; each has the flag "clipped".
  std::optional<std::string> apply(Frame& frame, int full_scale,
                                   std::string_view remedy = "set a hotter range");

  /// In which frames are stored from now on, as far as is known.
  double kelvin_per_count() const { return kelvin_per_count_; }
  /// No finer than what the session's frames have already (another connection, a resumed session);
  /// linear samples keep the camera's scale.
  void store_no_finer_than(double kelvin_per_count);

 private:
  int to_counts(Frame& frame, int full_scale);

  double kelvin_per_sample_ = 0;
  double kelvin_per_count_ = kelvin_per_dn;
  std::vector<double> kelvin_;  ///< empty: linear
  bool told_ = false;
};

/// Kelvin per sample that a camera may have: a bigger one is a slip, and no tag may hold it.
inline constexpr double max_kelvin_per_sample = 10;

}  // namespace orbitfuse
