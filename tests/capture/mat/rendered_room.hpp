// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"

namespace orbitfuse::test {

/// A floor with an uneven texture, the mat in its middle with a box on it, and some boxes round it,
/// ray-cast with 2 x 2 rays a pixel, CV_8UC1. Without a mat (empty) its place is bare floor.
cv::Mat view_of_room(const cv::Mat& mat, double mat_size_m, const Camera& camera,
                     const Rigid3d& cam_from_mat);

}  // namespace orbitfuse::test
