// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/geometry/level_plane.hpp"
#include "core/geometry/reconstruction.hpp"
#include "recon/depth/dense_depth.hpp"
#include "recon/depth/stereo/depth_view.hpp"

namespace orbitfuse::depth {

/// A plain is seen far out by the lowest views only and has no texture there, nor has the sky:
/// nothing confirms their depth, and a field is free to stand the plain up as a curtain and to fill
/// the sky with fog. Gives pixels without depth
/// - the plane's, where they are below the horizon, beyond the cameras, of the ground's gray level,
///   with nothing but such ground between them and the camera's foot, and nothing confirmed by any
///   view before or above them that is nearer; at most `far` (in scene radii) from the centre, what
///   is farther stands there;
/// - an infinite one, where they are above the horizon, nothing is confirmed and nothing else
/// begins
///   up to the image's border, and something does about the horizon;
/// and where more of the other views show the same gray level in that place than another one.
/// `points`: of the sparse model, in scene radii, confirmed as depths are. Returns the shares of
/// all pixels that got a depth.
OpenSpace extend_over_ground(const std::vector<DepthView>& views, const LevelPlane& ground,
                             const std::vector<Eigen::Vector3f>& points, float far,
                             std::vector<DepthMap>& maps);

}  // namespace orbitfuse::depth
