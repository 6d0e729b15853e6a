// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/cnn_lpif/cnn_lpif.hpp"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/parallel.hpp"
#include "fusion/cnn_lpif/band_rule.hpp"
#include "fusion/cnn_lpif/score_map.hpp"
#include "fusion/pyramid/pyramid.hpp"

namespace orbitfuse::fusion {
namespace {

/// One byte a patch: do the sources differ anywhere in it?
cv::Mat1b differing_patches(const Plane& visible, const Plane& thermal, double same_within) {
  cv::Mat differs = cv::abs(visible - thermal) > same_within, spread;
  cv::dilate(differs, spread, cv::Mat::ones(cnn::patch, cnn::patch, CV_8U), {0, 0}, 1,
             cv::BORDER_CONSTANT, 0);
  cv::Mat1b patches((visible.rows - cnn::patch) / 2 + 1, (visible.cols - cnn::patch) / 2 + 1);
  for (int y = 0; y < patches.rows; ++y)
    for (int x = 0; x < patches.cols; ++x) patches(y, x) = spread.at<uchar>(2 * y, 2 * x);
  return patches;
}

/// Mean of the weights of all patches that cover a pixel.
Plane averaged_over_patches(const Plane& weights, cv::Size size) {
  constexpr int reach = cnn::patch / 2;  // patches that cover a pixel pair, along one axis
  // Rows and columns beyond the last patch repeat its weight.
  Plane padded;
  const int rows = (size.height + 1) / 2, columns = (size.width + 1) / 2;
  cv::copyMakeBorder(weights, padded, reach - 1, std::max(0, rows - weights.rows), reach - 1,
                     std::max(0, columns - weights.cols), cv::BORDER_REPLICATE);
  Plane mean, full(size);
  cv::boxFilter(padded, mean, CV_32F, {reach, reach}, {0, 0});
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) full(y, x) = mean(y / 2, x / 2);
  return full;
}

}  // namespace

Status CnnLpifOptions::validate() const {
  if (!(match_threshold >= 0 && match_threshold <= 1))
    return fail(ErrorKind::usage, "cnn_lpif.match_threshold", fmt::format("{}", match_threshold), "must be in 0..1");
  if (!(same_within >= 0 && same_within <= 255))
    return fail(ErrorKind::usage, "cnn_lpif.same_within", fmt::format("{}", same_within), "must be in 0..255");
  if (!(network_bands >= 0 && network_bands <= 32))
    return fail(ErrorKind::usage, "cnn_lpif.network_bands", fmt::format("{}", network_bands), "must be in 0..32");
  if (!(vote_px >= 1 && vote_px <= 255 && vote_px % 2 == 1))
    return fail(ErrorKind::usage, "cnn_lpif.vote_px", fmt::format("{}", vote_px), "must be odd, in 1..255");
  return {};
}

Plane thermal_weight(const Plane& visible, const Plane& thermal, const CnnLpifOptions& options,
                     CnnLpifReport& report, const cnn::Parameters& network) {
  const cv::Mat1b needed = differing_patches(visible, thermal, options.same_within);
  report.patches_skipped = 1 - static_cast<double>(cv::countNonZero(needed)) / static_cast<double>(needed.total());
  const Plane v = cnn::score_map(visible, network, needed), t = cnn::score_map(thermal, network, needed);
  Plane weights(v.size());
  for (int y = 0; y < v.rows; ++y)
    for (int x = 0; x < v.cols; ++x)
      weights(y, x) = needed(y, x) ? 1 / (1 + std::exp(v(y, x) - t(y, x))) : 0.5F;
  return averaged_over_patches(weights, visible.size());
}

Result<Plane> fuse_cnn_lpif(const Plane& visible, const Plane& thermal, const CnnLpifOptions& options,
                            CnnLpifReport* report, const cnn::Parameters& network) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(check_pair(visible, thermal));
  CnnLpifReport own;
  CnnLpifReport& said = report ? *report : own;
  said = {};
  if (differing_share(visible, thermal, 0) == 0) {
    said.skipped = true;
    said.patches_skipped = 1;
    return visible.clone();
  }
  const int levels = static_cast<int>(std::floor(std::log2(std::min(visible.rows, visible.cols))));
  const std::vector<Plane> weights = gaussian_pyramid(thermal_weight(visible, thermal, options, said, network), levels);
  LaplacianPyramid v, t, fused;
  parallel_for(2, [&](int i) {
    (i == 0 ? v : t) = laplacian_pyramid(i == 0 ? visible : thermal, levels);
  });
  const auto threshold = static_cast<float>(options.match_threshold);
  for (std::size_t i = 0; i < v.bands.size(); ++i) {
    const bool asked = static_cast<int>(i) < options.network_bands;
    const Plane prior = asked ? weights[i] : Plane(weights[i].size(), 0.5F);
    fused.bands.push_back(fuse_band(v.bands[i], t.bands[i], weights[i], prior, {threshold, options.vote_px}));
  }
  fused.base = v.base + weights.back().mul(t.base - v.base);
  return collapse(fused);
}

}  // namespace orbitfuse::fusion
