// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/result.hpp"

// Image quality, every value by a named definition. The fusion metrics follow the code of VIFB
// (Zhang, Ye, Xiao, CVPRW 2020) to rounding error, its quirks included, so that numbers can be
// compared with published ones; where VIFB's own definition is scaled wrongly (PSNR, RMSE) the
// textbook one is the default and VIFB's is given beside it. The rendering metrics are those of the
// paper that the recipes nerf-rgb and nerf-ir follow as well; by title and abstract it is "An
// Improved NeRF-Based Method for Augmenting, Registering, and Fusing Visible and Infrared Images"
// (Photonics 2025, 12(9), 842).
namespace orbitfuse {

struct MetricValue {
  std::string name;        ///< "Qabf"
  std::string definition;  ///< what exactly, and whose
  double value = 0;
};

/// MV SD EN SF AG EI Qabf MI PSNR RMSE SSIM CE Qcb Qcv SCD CC PSNR_vifb RMSE_vifb SSIM_sum halo of
/// one fused pair. Images: CV_8U or CV_16U (scaled to 0..255), or CV_32F in 0..255; 1 or 3 channels
/// (a gray source beside a colour fused image is repeated); colour: mean over the channels. All
/// of one size, at least 16 x 16. Errors (input: type, channels, samples that are not finite,
/// sizes) name the image ("visible", "thermal", "fused").
Result<std::vector<MetricValue>> fusion_metrics(const cv::Mat& visible, const cv::Mat& thermal,
                                                const cv::Mat& fused);

/// The same of several fused images of one pair, in their order: what depends on the sources alone
/// is computed once. Errors name "fused image 1" and so on.
Result<std::vector<std::vector<MetricValue>>> fusion_metrics(const cv::Mat& visible,
                                                             const cv::Mat& thermal,
                                                             const std::vector<cv::Mat>& fused);

/// SSIM, cosine similarity, mutual information, PSNR, histogram similarity of a rendered view
/// against the truth (Tables 4 to 6 of that paper). Same image types and errors.
Result<std::vector<MetricValue>> render_metrics(const cv::Mat& truth, const cv::Mat& rendered);

struct TemperatureError {
  double mae_k = 0, rmse_k = 0, bias_k = 0;
  std::size_t pixels = 0;
};
/// Kelvin images (CV_32FC1) where both are finite and the mask (CV_8UC1, may be empty) is not 0.
/// Input error when no pixel is left.
Result<TemperatureError> temperature_error(const cv::Mat& truth_k, const cv::Mat& rendered_k,
                                           const cv::Mat& mask = {});

/// Single values on any of the image types above.
namespace metrics {
inline constexpr double identical_psnr_db = 100;  ///< what PSNR is cut off at; identical images
Result<double> psnr(const cv::Mat& a, const cv::Mat& b);
Result<double> ssim(const cv::Mat& a, const cv::Mat& b);
}  // namespace metrics

}  // namespace orbitfuse
