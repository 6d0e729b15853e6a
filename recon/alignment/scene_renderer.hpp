// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <opencv2/core.hpp>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"
#include "core/result.hpp"

// What alignment asks of a scene: to be seen from any camera. A trained field, a painted one and
// the synthetic scenes of the tests all answer through this.
namespace orbitfuse {

/// A posed scene as some camera sees it.
struct SceneRender {
  /// CV_32FC1 on any scale that all renders of a scene share (a field's: 0..1): only its edges are
  /// looked at.
  cv::Mat brightness;
  cv::Mat depth;  ///< CV_32FC1, along the optical axis, world units; NaN = nothing there
};
/// At the camera's size, which has no distortion. Errors are handed on to who asked for alignment.
using SceneRenderer =
    std::function<Result<SceneRender>(const Camera&, const Rigid3d& cam_from_world)>;

}  // namespace orbitfuse
