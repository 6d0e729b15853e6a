// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "recon/poses/patches/patch_alignment.hpp"

// Observations of a posed model, moved to where the images show the very same piece of surface, and
// further ones in views where no descriptor matched (after P. Lindenberger et al., Pixel-Perfect
// Structure-from-Motion, ICCV 2021, on grey values). docs/notes/poses_visible.md has the figures
// that chose the correlations and the angle.
namespace orbitfuse {

struct TrackAlignmentOptions {
  PatchOptions patch;
  double min_correlation = 0.8;  ///< of an observation with its track's reference
  double max_shift_px = 2;       ///< beyond, it is another place that looks alike
  double max_sigma_px = 0.15;    ///< a vaguer place is worse than none
  /// Of a step in the reference's image, seen in the other one: beyond, samples skip pixels.
  double max_magnification = 4;
  /// Of views that no descriptor joined to the track: nothing but the images speaks for them.
  double min_added_correlation = 0.9;
  double max_added_shift_px = 1.5;
  double max_added_angle_deg = 45;  ///< between the rays to the reference and to the view
  int max_added_views = 16;         ///< that a track is looked for in, the nearest first
  /// A view that would be left with fewer keeps what could not be aligned too: a dim or blurred one
  /// would lose its pose.
  int min_aligned_a_view = 60;

  Status validate() const;
};

struct TrackAlignment {
  Reconstruction model;  ///< views as before, to be adjusted
  /// Observations beside those that the others were compared with: found again, not found, of the
  /// last those that are in no track any more; and found in further views.
  int aligned = 0, unaligned = 0, left_out = 0, added = 0;
  double rms_shift_px = 0;  ///< of what was aligned, in the images' pixels

  /// Of what was to be found again; 0 where there was nothing.
  double share() const { return aligned / std::max(1.0, 1.0 * aligned + unaligned); }
};

/// `images` are CV_32FC1, one a view, of any size. The same for any thread count. A track in which
/// nothing is found again gets no further views: nothing but the model's own poses would speak for
/// them. Errors: usage (the options), cancelled.
Result<TrackAlignment> align_tracks(const Reconstruction& model, const std::vector<cv::Mat>& images,
                                    const TrackAlignmentOptions& options, const Progress& progress);

}  // namespace orbitfuse
