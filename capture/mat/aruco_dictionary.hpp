// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/aruco.hpp>

#include "capture/mat/mat_design.hpp"

namespace orbitfuse {

/// 4x4 bits: the largest cells for a tag's size, which decides at a distance. The smallest
/// dictionary that has enough tags keeps them most unlike each other.
inline cv::Ptr<cv::aruco::Dictionary> dictionary_of(const MatDesign& design) {
  return cv::aruco::getPredefinedDictionary(design.tags() <= 50    ? cv::aruco::DICT_4X4_50
                                            : design.tags() <= 100 ? cv::aruco::DICT_4X4_100
                                                                   : cv::aruco::DICT_4X4_250);
}

}  // namespace orbitfuse
