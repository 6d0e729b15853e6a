// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "core/result.hpp"
#include "fusion/heat/heat_scale.hpp"
#include "fusion/pyramid/image_pair.hpp"

// The visible picture with what is warmer than its surroundings coloured: read from a distance, and
// without a change where nothing is warm. Every pixel is coloured by its own temperature, so there
// is nothing that could ring or glow round an edge.
namespace orbitfuse::fusion {

struct HeatOptions {
  std::string palette = "inferno";  ///< one of palette_names()
  double opacity = 0.85;  ///< of the colour where it is hot; the rest is the visible picture
  /// Share of the colour's brightness that follows the visible one, so that texture shows through
  /// it.
  double shading = 0.3;
  /// Contrast of the hatching where nothing was measured; 0 = none.
  double hatching = 0.1;
  /// Of the whole scene, so that equal temperatures look alike in all its views; none: the image's
  /// own.
  std::optional<HeatScale> scale;

  Status validate() const;  ///< usage error naming the field
};

/// visible: CV_32FC3, BGR, 0..255. thermal: in any unit. measured: 0..1, how far a pixel's level is
/// known (empty = everywhere); where it is 0 the thermal sample is not looked at. Returns CV_32FC3.
/// All of one size, which is any. Usage errors: options.
Result<cv::Mat> colored_by_heat(const cv::Mat& visible, const Plane& thermal, const Plane& measured,
                                const HeatOptions& options);

/// 256 colours (CV_8UC3, 1x256, BGR) for levels from HeatScale::usual to hot in equal steps: from
/// where the palette leaves black, which would look like a shadow, to its end. How opaque a level's
/// colour lies over the visible picture is another matter: HeatScale::strength. Usage error:
/// unknown palette.
Result<cv::Mat> heat_colors(const std::string& palette);

/// 0..1 along diagonal stripes, for a pixel where nothing was measured.
bool on_hatching(int x, int y, int period);

/// Gray stripes over a palette's picture (CV_8UC3) wherever `levels` (CV_32FC1) hold no number:
/// black would be the palette's coldest colour.
void hatch_unmeasured(cv::Mat& painted_bgr, const cv::Mat& levels);

}  // namespace orbitfuse::fusion
