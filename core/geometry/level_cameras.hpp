// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/geometry/reconstruction.hpp"

// Which way is up, as far as poses (cam_from_world) alone say it.
namespace orbitfuse {

std::vector<Rigid3d> cameras_of(const std::vector<PosedView>& views);

/// Point nearest to all optical axes (robust least squares). NaN when the axes are parallel.
Eigen::Vector3d look_at_point(const std::vector<Rigid3d>& cameras);

/// The cameras lay on their side (portrait) without their images being turned, on a walk of 125
/// degrees and more, below 45 degrees of elevation: level axes of a walk round something point all
/// round, those across them lean together.
bool held_on_side(const std::vector<Rigid3d>& cameras);

/// Unit vector most orthogonal to all camera x axes, on the side of the cameras' up: handheld and
/// tripod cameras are level on average. Of cameras held on their side: to all y axes, and up is
/// where they stand above what they look at. Falls back to the mean up when the axes are parallel.
Eigen::Vector3d up_direction(const std::vector<Rigid3d>& cameras);

/// Of the cameras that don't look straight down, how many `up` lies beside or below in their image.
double share_not_upright(const std::vector<Rigid3d>& cameras, const Eigen::Vector3d& up);

}  // namespace orbitfuse
