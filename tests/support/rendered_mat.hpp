// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "capture/mat/mat_design.hpp"
#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"

namespace orbitfuse::test {

/// The printed mat seen from above, white paper, black ink; one pixel is `pixel_m`.
cv::Mat printed_mat(const std::vector<MatRectangle>& black, double size_m, double pixel_m);

/// A camera on an orbit round the mat, looking at its middle. Independent of the code under test.
Rigid3d orbit_pose(double azimuth_deg, double elevation_deg, double distance_m);

/// Antialiased view of the printed mat (side `size_m`) lying on grey ground, CV_8UC1.
cv::Mat view_of_mat(const cv::Mat& mat, double size_m, const Camera& camera,
                    const Rigid3d& cam_from_mat);

}  // namespace orbitfuse::test
