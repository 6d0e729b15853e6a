// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse::view {

/// Several pictures in one answer, little-endian: uint32 length of a JSON object, the object
/// (padded with spaces, so that the parts begin on a multiple of four), then its "parts" one after
/// the other:
/// {"name", "bytes", "width", "height"} and "encoding": "jpeg", or "uint16" with "scale" and
/// "offset" (value = scale * count + offset, 0 = nothing there).
class PictureParts {
 public:
  Status add_jpeg(const std::string& name, const cv::Mat& bgr, int quality);
  /// CV_32FC1 kelvin or gray levels; NaN = nothing there.
  void add_levels(const std::string& name, const cv::Mat& levels, bool gray);
  std::string bytes() const;

 private:
  nlohmann::json parts_ = nlohmann::json::array();
  std::vector<std::string> contents_;
};

}  // namespace orbitfuse::view
