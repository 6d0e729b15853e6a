// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/system/cpu.hpp"
#include "fusion/cnn_lpif/network.hpp"
#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion::cnn {

/// Scores of the patches whose top-left corner is (2 j, 2 i), j and i over the map: the network as
/// convolutions over the image. `needed` (CV_8UC1, one byte a patch, empty = all): what lies
/// outside the needed runs of columns of a strip of rows is not computed and left at 0. Same bits
/// for every instruction set and thread count.
Plane score_map(const Plane& image, const Parameters& parameters, const cv::Mat1b& needed = {},
                Isa isa = best_isa());

}  // namespace orbitfuse::fusion::cnn
