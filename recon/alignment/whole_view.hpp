// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "recon/alignment/scene_renderer.hpp"

// A whole image against whole renders. Patches are exact but follow a repeated form (the ribs of a
// container) to the next repetition, and stay there; the normalised correlation of all edges has
// one broad peak over azimuth, elevation and distance, if every place is rendered anew.
namespace orbitfuse {

struct WholeMatch {
  double correlation = -1;  ///< normalised: edges that only one of the two shows count against it
  double shift_x_px = 0, shift_y_px = 0;  ///< of the render, to the best fit
};

/// `edges`: rendered_edges; `field`: orientation_field of the image, same size.
WholeMatch match_whole(const cv::Mat& edges, const cv::Mat& field, int reach_px);

/// A pose moved about the orbit's centre to an azimuth, elevation and distance there.
struct OrbitMove {
  double azimuth_deg = 0, elevation_deg = 0, log_radius = 0;
};
Rigid3d moved(const Rigid3d& cam_from_world, const Similarity3d& canonical_from_world,
              const OrbitMove& move);

struct AscentOptions {
  int width_px = 160;
  int reach_px = 12;  ///< of the image shift
  double first_step_deg = 4, last_step_deg = 1;
};

/// Ascends to the highest correlation of `image` (CV_32FC1) from `view`, which takes the place
/// found. Returns the correlation there. Errors: the renderer's, cancelled.
Result<double> ascend_correlation(const SceneRenderer& renderer,
                                  const Similarity3d& canonical_from_world, const cv::Mat& image,
                                  PosedView& view, const AscentOptions& options,
                                  const Progress& progress);

}  // namespace orbitfuse
