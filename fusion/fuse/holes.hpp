// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse {

/// Holes filled from the valid pixels round them, coarse to fine, so that filters across the edge
/// of a hole see a smooth continuation instead of its contents.
fusion::Plane filled(const fusion::Plane& image, const cv::Mat1b& valid);

/// How far the thermal image counts, 0..1: 0 where `valid` is 0, rising over some pixels inside, so
/// that a hole fades into the visible image instead of ending in a ragged edge. A lone hole of a
/// pixel costs its neighbours nothing; an island of a few pixels is dropped.
fusion::Plane feathered(const cv::Mat1b& valid);

/// The part of the image that has to be fused: the valid pixels with what filters reach from them,
/// on a grid that all pyramids share. The whole image where that saves little.
cv::Rect needed_part(const cv::Mat1b& valid);

}  // namespace orbitfuse
