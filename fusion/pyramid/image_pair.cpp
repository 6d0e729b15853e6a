// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/pyramid/image_pair.hpp"

#include <fmt/format.h>

#include <cmath>

namespace orbitfuse::fusion {

Status check_pair(const cv::Mat& visible, const cv::Mat& thermal) {
  for (const auto& [image, name] : {std::pair{&visible, "visible"}, {&thermal, "thermal"}}) {
    if (image->type() != CV_32FC1)
      return fail(ErrorKind::input, name, "not one channel of floats",
                  "convert it to CV_32FC1, 0..255");
    if (image->cols < min_side_px || image->rows < min_side_px)
      return fail(ErrorKind::input, name, fmt::format("{}x{} pixels", image->cols, image->rows),
                  fmt::format("fusion needs at least {0}x{0}", min_side_px));
    // NaN compares false with everything, infinity fails against the largest float.
    if (!cv::checkRange(*image))
      return fail(ErrorKind::input, name, "samples that are not finite",
                  "fill or mask the holes first (fuse takes a mask of valid pixels)");
  }
  if (visible.size() != thermal.size())
    return fail(ErrorKind::input, "thermal",
                fmt::format("{}x{} pixels, the visible image has {}x{}", thermal.cols, thermal.rows,
                            visible.cols, visible.rows),
                "register or resize the pair first: pixels must correspond");
  return {};
}

double differing_share(const Plane& visible, const Plane& thermal, float tolerance) {
  return static_cast<double>(cv::countNonZero(cv::abs(visible - thermal) > tolerance)) /
         static_cast<double>(visible.total());
}

}  // namespace orbitfuse::fusion
