// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/result.hpp"

namespace orbitfuse::measurement {

/// How frames are read and trusted; chosen by bench/measurement (docs/benchmarks/measurement.md).
struct MeasurementOptions {
  /// Of the depth map that is kept for each thermal view. 320 costs four times as much on the first
  /// spot and makes no spot better.
  int depth_width_px = 160;
  /// A frame sees a point where its depth map has a surface there, within this share of the
  /// distance: fields are that unsure of depth.
  double depth_tolerance = 0.02;
  double max_angle_deg = 75;     ///< to the normal: beyond it a pixel smears over the surface
  double doubtful_weight = 0.2;  ///< of frames whose pose is doubtful, against 1 of sure ones
  /// One sigma of where a posed thermal view puts a point, in its own pixels: what a temperature
  /// gradient in the image turns into an error.
  double pose_sigma_px = 1.0;
  double noise_sigma_k = 0.05;  ///< of one sample of a thermal camera
  /// One sigma of what is the same in all frames and cannot be seen in them: fixed pattern,
  /// vignetting and slow drift of an uncooled camera. Most of a stated uncertainty.
  double common_sigma_k = 0.35;
  /// How much of each part counts as one sigma of the error: the mean's own, of frames that agree;
  /// what the poses make of a gradient; the difference of field and frames; and how much the field
  /// varies round the place.
  double statistical_share = 1, gradient_share = 0.5, disagreement_share = 0.5,
         variation_share = 0.3;
  /// Stated uncertainty per sigma: 90 % of a normal distribution.
  double coverage_factor = 1.65;

  Status validate() const;
};

}  // namespace orbitfuse::measurement
