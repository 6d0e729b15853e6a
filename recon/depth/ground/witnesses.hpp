// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "recon/depth/stereo/depth_view.hpp"

namespace orbitfuse::depth {

/// As a depth: farther than anything.
inline constexpr float nothing = 1e6f;
/// Something confirmed this much nearer than a place hides it.
inline constexpr float hides = 0.93f;

/// What other views show where one view's pixel is thought to see the ground or the sky.
class Witnesses {
 public:
  /// `gray`: CV_8UC1; `obstacles`: the nearest that is confirmed, CV_32FC1 depths, beyond `nothing`
  /// where there is none. One a view; all must outlive this.
  Witnesses(const std::vector<DepthView>& views, const std::vector<cv::Mat>& gray,
            const std::vector<cv::Mat>& obstacles)
      : views_(views), gray_(gray), obstacles_(obstacles) {}

  /// More views that see the same gray level there than another one; what hides it from them counts
  /// for nothing. A wall that is taken for the ground behind it looks otherwise from the side.
  /// `z`: depth of the pixel of view `own`, infinite in the sky.
  bool agree(std::size_t own, cv::Point pixel, float z) const;

 private:
  const std::vector<DepthView>& views_;
  const std::vector<cv::Mat>&gray_, &obstacles_;
};

}  // namespace orbitfuse::depth
