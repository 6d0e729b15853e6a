// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <functional>

#include "fusion/metrics/measures.hpp"
#include "fusion/metrics/metrics.hpp"

namespace orbitfuse {
namespace {

using namespace metrics;

/// Mean over the channels of a measure of two images.
Result<double> over_channels(const cv::Mat& a, const cv::Mat& b, int min_side,
                             const std::function<double(const Plane&, const Plane&)>& measure) {
  ORBITFUSE_ASSIGN(const auto planes, matched_planes({a, b}, {"truth", "rendered"}, min_side));
  double sum = 0;
  for (std::size_t c = 0; c < planes[0].size(); ++c) sum += measure(planes[0][c], planes[1][c]);
  return sum / static_cast<double>(planes[0].size());
}

double dot(const Plane& a, const Plane& b) {
  double sum = 0;
  for (int y = 0; y < a.rows; ++y) {
    for (int x = 0; x < a.cols; ++x) sum += a(y, x) * b(y, x);
  }
  return sum;
}

/// Two black images point the same way; a black and another one do not.
double cosine(const Plane& a, const Plane& b) {
  const double aa = dot(a, a), bb = dot(b, b);
  if (aa == 0 || bb == 0) return aa == bb ? 1 : 0;
  return dot(a, b) / std::sqrt(aa * bb);
}

}  // namespace

namespace metrics {

Result<double> psnr(const cv::Mat& a, const cv::Mat& b) {
  // The peak is over all channels together, as everywhere in the NeRF literature.
  ORBITFUSE_ASSIGN(const double mse, over_channels(a, b, 1, mean_squared_error));
  return psnr_db(mse);
}

Result<double> ssim(const cv::Mat& a, const cv::Mat& b) {
  return over_channels(a, b, 11, structural_similarity);
}

}  // namespace metrics

Result<std::vector<MetricValue>> render_metrics(const cv::Mat& truth, const cv::Mat& rendered) {
  std::vector<MetricValue> values;
  const auto add = [&](const char* name, const char* definition,
                       const Result<double>& value) -> Status {
    ORBITFUSE_TRY(value);
    values.push_back({name, definition, *value});
    return {};
  };
  ORBITFUSE_TRY(add("SSIM", "Wang 2004, 11x11 Gaussian, valid, mean over channels",
                    metrics::ssim(truth, rendered)));
  ORBITFUSE_TRY(add("cosine", "cosine of the angle between the images as vectors",
                    over_channels(truth, rendered, 1, cosine)));
  ORBITFUSE_TRY(add("MI", "mutual information, 256 bins of 0..255, nats",
                    over_channels(truth, rendered, 1, mutual_information_nats)));
  ORBITFUSE_TRY(add("PSNR", "peak 255, dB", metrics::psnr(truth, rendered)));
  ORBITFUSE_TRY(add("hist", "histogram intersection, 256 bins of 0..255",
                    over_channels(truth, rendered, 1, histogram_intersection)));
  return values;
}

Result<TemperatureError> temperature_error(const cv::Mat& truth_k, const cv::Mat& rendered_k,
                                           const cv::Mat& mask) {
  if (truth_k.empty() || truth_k.type() != CV_32FC1 || rendered_k.type() != CV_32FC1 ||
      truth_k.size() != rendered_k.size()) {
    return fail(ErrorKind::input, "temperature images", "not two float images of one size",
                "render at the size of the truth");
  }
  if (!mask.empty() && (mask.type() != CV_8UC1 || mask.size() != truth_k.size())) {
    return fail(ErrorKind::input, "mask", "not an 8-bit image of the size of the others",
                "resize it");
  }
  double absolute = 0, squared = 0, sum = 0;
  std::size_t n = 0;
  for (int y = 0; y < truth_k.rows; ++y) {
    for (int x = 0; x < truth_k.cols; ++x) {
      const double d = static_cast<double>(rendered_k.at<float>(y, x)) -
                       static_cast<double>(truth_k.at<float>(y, x));
      if (!std::isfinite(d) || (!mask.empty() && mask.at<std::uint8_t>(y, x) == 0)) continue;
      absolute += std::abs(d);
      squared += d * d;
      sum += d;
      ++n;
    }
  }
  if (n == 0)
    return fail(ErrorKind::input, "temperature images", "no valid pixel in both",
                "check the mask and the render");
  const double pixels = static_cast<double>(n);
  return TemperatureError{absolute / pixels, std::sqrt(squared / pixels), sum / pixels, n};
}

}  // namespace orbitfuse
