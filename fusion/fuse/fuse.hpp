// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/progress.hpp"
#include "fusion/best/best.hpp"
#include "fusion/cnn_lpif/cnn_lpif.hpp"
#include "fusion/ms_srif/ms_srif.hpp"
#include "fusion/pca_msif/pca_msif.hpp"

// One aligned pair to one fused image, by any of the methods.
namespace orbitfuse {

enum class FusionMethod { best, ms_srif, pca_msif, cnn_lpif };
const char* name(FusionMethod method);              ///< "best", "ms-srif", "pca-msif", "cnn-lpif"
std::vector<std::string> fusion_method_names();
Result<FusionMethod> fusion_method(const std::string& name);  ///< usage error with the known names

struct FusionOptions {
  FusionMethod method = FusionMethod::best;
  /// The visible image's chroma is kept and its luma fused; off: the result is gray.
  bool color = true;
  fusion::BestOptions best;
  fusion::MsSrifOptions ms_srif;
  fusion::PcaMsifOptions pca_msif;
  fusion::CnnLpifOptions cnn_lpif;

  Status validate() const;
};

struct FusionReport {
  std::vector<Skip> skips;
  double wall_s = 0;
};

/// visible: CV_8U or CV_16U, 1 or 3 channels (BGR). thermal: CV_8U or CV_16U gray (3 channels are
/// reduced to their luma), of one size with visible, pixels corresponding. valid: CV_8UC1, 0 where
/// the thermal image holds nothing (a rendered hole); empty = all valid. There the result is the
/// visible image, and the hole's values never reach its surroundings. Returns CV_8UC1 or CV_8UC3.
/// Errors (input): types, sizes that differ, below 16 x 16, no valid pixel.
Result<cv::Mat> fuse(const cv::Mat& visible, const cv::Mat& thermal, const cv::Mat& valid,
                     const FusionOptions& options, FusionReport* report = nullptr);

}  // namespace orbitfuse
