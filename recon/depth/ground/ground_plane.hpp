// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/result.hpp"
#include "recon/depth/stereo/depth_view.hpp"

namespace orbitfuse::depth {

/// The plain that an object stands on, in units of the scene radius, origin at the scene's centre.
struct OpenGround {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< away from the ground, towards the cameras
  float offset = 0;

  float height(const Eigen::Vector3f& x) const { return normal.dot(x) + offset; }
};

/// The plane under all cameras that most confirmed depths lie on, nothing below it (RANSAC, then
/// least squares). `maps`: one a view, in the views' unit. Errors: quality (there is none; why).
Result<OpenGround> find_ground(const std::vector<DepthView>& views,
                               const std::vector<DepthMap>& maps, std::uint64_t seed);

}  // namespace orbitfuse::depth
