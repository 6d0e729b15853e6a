// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <opencv2/core.hpp>
#include <vector>

namespace orbitfuse {

/// What is usual in a scene and what is hot there, in the unit of its thermal images.
struct HeatScale {
  double usual = 0;   ///< level of the surroundings: up to here nothing is coloured
  double spread = 0;  ///< how far the surroundings scatter round it
  double hot = 0;     ///< colour at its full strength, the palette's end

  /// 0..1: how unusual a level is, i.e. how opaque its colour is. Rises strictly from `usual` to
  /// `hot`: a level within the scatter of the surroundings counts little, one that stands out
  /// counts by its height.
  double strength(double level) const;
  bool is_valid() const;  ///< finite, rising, spread not negative
};

struct HeatScaleOptions {
  /// Share of samples above `hot`: a bolt as small as 1e-4 of a view still has its own colour,
  /// while single noisy pixels don't stretch the scale.
  double hotter_share = 1e-4;
  /// Least `hot` - `usual`, in the image's unit: below it colour would show nothing but noise.
  double min_width = 2;
  /// The highest level that a sample can have; a field's may be higher.
  double highest = std::numeric_limits<double>::infinity();

  /// For 8-bit images, whose noise is some gray levels.
  static HeatScaleOptions of_gray_levels() { return {.min_width = 16, .highest = 255}; }
};

/// A scale whose `hot` is at most the options' highest level, unless it were less than their
/// `min_width` wide then: noise on what is bright everywhere is nothing hot.
HeatScale within_levels(HeatScale scale, const HeatScaleOptions& options);

/// One scale for all images of a scene (CV_32FC1, NaN and infinite = nothing measured): `usual` is
/// their median, `spread` the smaller distance to a quartile (the larger one reaches into the sky
/// or the hot object). Without a finite sample: 0, 0, min_width.
HeatScale heat_scale(const std::vector<cv::Mat>& images, const HeatScaleOptions& options = {});

}  // namespace orbitfuse
