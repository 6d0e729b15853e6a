// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace orbitfuse {

/// A pixel of an orientation field (edge_field.hpp) that carries an edge.
struct EdgePixel {
  int x = 0, y = 0;
  float re = 0, im = 0;  ///< of the field
  float strength = 0;
};

/// Pixels stronger than the threshold, row by row; the rest of a field says nothing.
std::vector<EdgePixel> edge_pixels(const cv::Mat& edges, float threshold);

/// An image's field as two planes inside a border of zeros.
class FieldPlanes {
 public:
  /// `field`: CV_32FC2. Edge pixels inside its frame may be shifted by up to `reach_px`.
  FieldPlanes(const cv::Mat& field, int reach_px);

  /// Correlation of edge pixels with the field at every shift from (cx - reach, cy - reach) to
  /// (cx + reach, cy + reach); |cx|, |cy| + reach <= reach_px. Each shift sums the pixels in their
  /// order, in float.
  cv::Mat1f correlation(const std::vector<EdgePixel>& pixels, int cx, int cy, int reach) const;

  /// Squared strength of the field at a pixel; 0 outside.
  float energy(int x, int y) const;

 private:
  int reach_px_;
  cv::Mat1f re_, im_;
};

}  // namespace orbitfuse
