// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "recon/poses/estimate_poses.hpp"

// What thermal views are compared with, and as what. Internal to recon/poses.
namespace orbitfuse {

/// A thermal frame's values as `lens` without its distortion would have seen them: edges are
/// compared with straight renders.
Result<cv::Mat> straight_luminance(const Session& session, const FrameRecord& frame,
                                   const Camera& lens);

/// The scene for alignment: most of its views are made of a few renders, at the visible views.
/// `visible` must outlive the result. Errors: the renderer's, cancelled.
Result<SceneRenderer> scene_of(const VisibleScene& visible,
                               const Similarity3d& canonical_from_visible,
                               const Progress& progress);

}  // namespace orbitfuse
