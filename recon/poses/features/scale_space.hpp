// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

// Gaussian scale space, an octave at a time: levels a third of an octave apart, each blurred from
// the one below it.
namespace orbitfuse {

constexpr int scales_per_octave = 3;

/// Levels -1 to 4 of one octave, CV_32F, [0, 1], all of one size. Behind each row eight floats more
/// may be read.
struct Octave {
  double spacing_px = 1;  ///< pixels of the image from one sample to the next
  std::vector<cv::Mat> levels;

  int width() const { return levels.front().cols; }
  int height() const { return levels.front().rows; }
  /// scale: from 0 to scales_per_octave - 1, where extrema lie.
  const cv::Mat& level(int scale) const { return levels[static_cast<std::size_t>(scale + 1)]; }
  /// Standard deviation of the blur at a scale, fractions too, in samples.
  static double sigma(double scale);
};

/// At twice the size of an 8-bit image of one channel, which must not be empty.
Octave first_octave(const cv::Mat& gray);
/// At half the size of one; absent when nothing is left.
std::optional<Octave> next_octave(const Octave& octave);

/// Convolution with a Gaussian that is cut at four standard deviations; the outermost samples go
/// on. CV_32F. The same on every processor.
cv::Mat blurred(const cv::Mat& image, double sigma);

}  // namespace orbitfuse
