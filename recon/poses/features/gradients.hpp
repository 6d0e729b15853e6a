// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "recon/poses/features/scale_extrema.hpp"

namespace orbitfuse {

/// Brightness gradients of one level, CV_32F: lengths, and directions in turns, [0, 1).
struct Gradients {
  cv::Mat length, turns;
};

Gradients gradients(const cv::Mat& level);

/// Directions (turns) that the gradients about a peak point in: those of at least 0.8 of the most
/// frequent one's weight (Lowe, 5), in the order of their angles, at most four.
std::vector<float> dominant_turns(const Gradients& gradients, const ScaleExtremum& at);

/// 4 x 4 cells of 8 directions, turned by `turns` (Lowe, 6.1): a unit vector, none of whose shares
/// was above 0.2 before it was scaled; zero where there are no gradients. Cells row by row,
/// directions by growing turns.
std::array<float, 128> descriptor(const Gradients& gradients, const ScaleExtremum& at, float turns);

}  // namespace orbitfuse
