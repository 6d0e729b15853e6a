// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/cnn_lpif/cnn_lpif.hpp"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/system/parallel.hpp"
#include "fusion/cnn_lpif/band_rule.hpp"
#include "fusion/cnn_lpif/score_map.hpp"
#include "fusion/pyramid/bands.hpp"
#include "fusion/pyramid/pyramid.hpp"

namespace orbitfuse::fusion {
namespace {

/// What the network is not asked for, and what it is.
enum PatchKind : uchar { equal = 0, visible_only = 1, thermal_only = 2, asked = 255 };

/// Maximum and minimum of every 16x16 window at its top-left pixel, in gray levels.
cv::Mat1b range_of(const Plane& image) {
  const cv::Mat square = cv::Mat::ones(cnn::patch, cnn::patch, CV_8U);
  cv::Mat1b levels, high, low;
  image.convertTo(levels, CV_8U);
  cv::dilate(levels, high, square, {0, 0}, 1, cv::BORDER_REPLICATE);
  cv::erode(levels, low, square, {0, 0}, 1, cv::BORDER_REPLICATE);
  return high - low;
}

/// A PatchKind a patch: alike within same_within, or one source flat within flat_within and the
/// other not.
cv::Mat1b patch_kinds(const Plane& visible, const Plane& thermal, const CnnLpifOptions& options) {
  cv::Mat differs = cv::abs(visible - thermal) > options.same_within, spread;
  cv::dilate(differs, spread, cv::Mat::ones(cnn::patch, cnn::patch, CV_8U), {0, 0}, 1,
             cv::BORDER_CONSTANT, 0);
  const cv::Mat1b range_v = range_of(visible), range_t = range_of(thermal);
  cv::Mat1b kinds((visible.rows - cnn::patch) / 2 + 1, (visible.cols - cnn::patch) / 2 + 1);
  for (int y = 0; y < kinds.rows; ++y)
    for (int x = 0; x < kinds.cols; ++x) {
      const bool flat_v = range_v(2 * y, 2 * x) <= options.flat_within,
                 flat_t = range_t(2 * y, 2 * x) <= options.flat_within;
      kinds(y, x) = !spread.at<uchar>(2 * y, 2 * x) || (flat_v && flat_t) ? equal
                    : flat_v                                              ? thermal_only
                    : flat_t                                              ? visible_only
                                                                          : asked;
    }
  return kinds;
}

float weight_of(uchar kind, float score_v, float score_t) {
  if (kind == asked) return 1 / (1 + std::exp(score_v - score_t));
  return kind == equal ? 0.5F : kind == thermal_only ? 1.0F : 0.0F;
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
    return fail(ErrorKind::usage, "cnn_lpif.match_threshold", fmt::format("{}", match_threshold),
                "must be in 0..1");
  if (!(same_within >= -1 && same_within <= 255))
    return fail(ErrorKind::usage, "cnn_lpif.same_within", fmt::format("{}", same_within),
                "must be in -1..255");
  if (!(flat_within >= -1 && flat_within <= 255))
    return fail(ErrorKind::usage, "cnn_lpif.flat_within", fmt::format("{}", flat_within),
                "must be in -1..255");
  if (!(network_bands >= 0 && network_bands <= 32))
    return fail(ErrorKind::usage, "cnn_lpif.network_bands", fmt::format("{}", network_bands),
                "must be in 0..32");
  if (!(network_halvings >= 0 && network_halvings <= 8))
    return fail(ErrorKind::usage, "cnn_lpif.network_halvings", fmt::format("{}", network_halvings),
                "must be in 0..8");
  if (!(vote_px >= 1 && vote_px <= 255 && vote_px % 2 == 1))
    return fail(ErrorKind::usage, "cnn_lpif.vote_px", fmt::format("{}", vote_px),
                "must be odd, in 1..255");
  return {};
}

Plane thermal_weight(const Plane& visible, const Plane& thermal, const CnnLpifOptions& options,
                     CnnLpifReport& report, const cnn::Parameters& network) {
  if (const int halvings = pyramid_levels(visible.size(), options.network_halvings, cnn::patch);
      halvings > 0) {
    CnnLpifOptions reduced = options;
    reduced.network_halvings = 0;
    const Plane weight =
        thermal_weight(gaussian_pyramid(visible, halvings).back(),
                       gaussian_pyramid(thermal, halvings).back(), reduced, report, network);
    Plane full;
    cv::resize(weight, full, visible.size(), 0, 0, cv::INTER_LINEAR);
    return full;
  }
  const cv::Mat1b kinds = patch_kinds(visible, thermal, options), needed = kinds == asked;
  report.patches_skipped =
      1 - static_cast<double>(cv::countNonZero(needed)) / static_cast<double>(needed.total());
  const Plane v = cnn::score_map(visible, network, needed),
              t = cnn::score_map(thermal, network, needed);
  Plane weights(v.size());
  parallel_blocks(v.rows, 16, [&](int begin, int end) {
    for (int y = begin; y < end; ++y)
      for (int x = 0; x < v.cols; ++x) weights(y, x) = weight_of(kinds(y, x), v(y, x), t(y, x));
  });
  return averaged_over_patches(weights, visible.size());
}

Result<Plane> fuse_cnn_lpif(const Plane& visible, const Plane& thermal,
                            const CnnLpifOptions& options, CnnLpifReport* report,
                            const cnn::Parameters& network) {
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
  const std::vector<Plane> weights =
      gaussian_pyramid(thermal_weight(visible, thermal, options, said, network), levels);
  LaplacianPyramid v, t, fused;
  parallel_for(
      2, [&](int i) { (i == 0 ? v : t) = laplacian_pyramid(i == 0 ? visible : thermal, levels); });
  const auto threshold = static_cast<float>(options.match_threshold);
  for (std::size_t i = 0; i < v.bands.size(); ++i) {
    if (silent(v.bands[i], t.bands[i])) {
      said.levels_skipped += 1.0 / levels;
      fused.bands.push_back(t.bands[i]);
      continue;
    }
    const bool in_reach = static_cast<int>(i) < options.network_bands;
    const Plane prior = in_reach ? weights[i] : Plane(weights[i].size(), 0.5F);
    fused.bands.push_back(
        fuse_band(v.bands[i], t.bands[i], weights[i], prior, {threshold, options.vote_px}));
  }
  fused.base = v.base + weights.back().mul(t.base - v.base);
  return collapse(fused);
}

}  // namespace orbitfuse::fusion
