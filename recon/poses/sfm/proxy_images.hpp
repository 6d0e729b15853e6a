// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/progress.hpp"
#include "core/result.hpp"
#include "core/session/session.hpp"

namespace orbitfuse {

/// What feature detectors are given instead of a recorded frame.
struct ProxyOptions {
  int max_side_px = 800;
  bool per_image_stretch = false;  ///< thermal: own 1-99 % span instead of the session's
  bool clahe = false;              ///< local contrast: +75 % points on radiometric thermal
  bool destripe = false;           ///< remove row and column offsets of the sensor
};

struct ProxyImage {
  const FrameRecord* frame = nullptr;
  std::string name;  ///< file in the proxy folder, "000000.png"
  int width = 0, height = 0;
};

/// Subtracts each row's and column's robust offset from a smoothed copy (fixed-pattern stripes).
cv::Mat without_stripes(const cv::Mat& image);

/// 8-bit PNGs of the frames, in their order. Raw 16-bit thermal gives COLMAP no features at all;
/// one span for the session keeps a surface's grey level the same in every view.
Result<std::vector<ProxyImage>> write_proxies(const Session& session,
                                              const std::vector<const FrameRecord*>& frames,
                                              const ProxyOptions& options,
                                              const std::filesystem::path& folder,
                                              const Progress& progress);

}  // namespace orbitfuse
