// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"
#include "drivers/synthetic/scene.hpp"

namespace orbitfuse::synthetic {

/// CV_8UC3 BGR (sRGB), the mean of samples_per_axis^2 rays a pixel.
cv::Mat render_visible(const Scene& scene, const Camera& camera, const Rigid3d& cam_from_world,
                       int samples_per_axis);
/// CV_32FC1 kelvin, likewise.
cv::Mat render_thermal(const Scene& scene, const Camera& camera, const Rigid3d& cam_from_world,
                       int samples_per_axis);
/// CV_32FC1, z along the optical axis at pixel centres, metres; NaN = sky.
cv::Mat render_depth(const Scene& scene, const Camera& camera, const Rigid3d& cam_from_world);

}  // namespace orbitfuse::synthetic
