// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/fuse/fuse.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <opencv2/imgproc.hpp>

#include "fusion/pyramid/pyramid.hpp"

namespace orbitfuse {
namespace {

using fusion::Plane;

constexpr std::pair<FusionMethod, const char*> methods[] = {{FusionMethod::best, "best"},
                                                            {FusionMethod::ms_srif, "ms-srif"},
                                                            {FusionMethod::pca_msif, "pca-msif"},
                                                            {FusionMethod::cnn_lpif, "cnn-lpif"}};

/// Floats in 0..255 with 1 or 3 channels.
Result<cv::Mat> floats_of(const cv::Mat& image, const char* which) {
  if ((image.depth() != CV_8U && image.depth() != CV_16U) || (image.channels() != 1 && image.channels() != 3))
    return fail(ErrorKind::input, which, fmt::format("{} channels of OpenCV depth {}", image.channels(), image.depth()),
                "give 8- or 16-bit samples, gray or BGR");
  cv::Mat floats;
  image.convertTo(floats, CV_32F, image.depth() == CV_16U ? 255.0 / 65535.0 : 1.0);
  return floats;
}

Plane luma(const cv::Mat& floats) {
  if (floats.channels() == 1) return floats;
  Plane gray;
  cv::cvtColor(floats, gray, cv::COLOR_BGR2GRAY);
  return gray;
}

/// Holes filled from the valid pixels round them, coarse to fine, so that filters across the edge
/// of a hole see a smooth continuation instead of its contents.
Plane filled(const Plane& image, const cv::Mat1b& valid) {
  Plane weight, weighted;
  valid.convertTo(weight, CV_32F, 1.0 / 255);
  weighted = image.mul(weight);
  weighted.setTo(0, ~valid);
  const int levels = fusion::pyramid_levels(image.size(), 16, 1);
  const auto weights = fusion::gaussian_pyramid(weight, levels), sums = fusion::gaussian_pyramid(weighted, levels);
  Plane result;
  for (int i = levels; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    Plane mean = sums[k] / cv::max(weights[k], 1e-6F);
    if (result.empty()) {
      result = mean;
      continue;
    }
    Plane coarse;
    cv::pyrUp(result, coarse, mean.size());
    const Plane w = i == 0 ? weights[k] : Plane(cv::min(weights[k] * 4, 1.0F));
    result = coarse + w.mul(mean - coarse);
  }
  image.copyTo(result, valid);
  return result;
}

Skip identical_pair() {
  return {"fusion", "the two images are identical", "the result is the image itself"};
}

Result<Plane> fuse_planes(const Plane& visible, const Plane& thermal, const FusionOptions& options,
                          std::vector<Skip>& skips) {
  switch (options.method) {
    case FusionMethod::best: {
      fusion::BestReport said;
      auto fused = fusion::fuse_best(visible, thermal, options.best, &said);
      if (said.skipped) skips.push_back(identical_pair());
      return fused;
    }
    case FusionMethod::ms_srif: {
      fusion::MsSrifReport said;
      auto fused = fusion::fuse_ms_srif(visible, thermal, options.ms_srif, &said);
      if (said.skipped) skips.push_back(identical_pair());
      else if (said.patches > 0)
        skips.push_back({"sparse codes",
                         fmt::format("{} of {} patches are decided by their DCT, {} are flat", said.certain_patches,
                                     said.patches, said.flat_patches),
                         fmt::format("{:.1f} atoms a patch of at most {}", said.atoms_per_patch, options.ms_srif.max_atoms)});
      return fused;
    }
    case FusionMethod::pca_msif: {
      fusion::PcaMsifReport said;
      auto fused = fusion::fuse_pca_msif(visible, thermal, options.pca_msif, &said);
      if (said.skipped) skips.push_back(identical_pair());
      return fused;
    }
    case FusionMethod::cnn_lpif: {
      fusion::CnnLpifReport said;
      auto fused = fusion::fuse_cnn_lpif(visible, thermal, options.cnn_lpif, &said);
      if (said.skipped) skips.push_back(identical_pair());
      else if (said.patches_skipped > 0)
        skips.push_back({"network on equal patches",
                         fmt::format("{:.1f} % of the patches do not differ", 100 * said.patches_skipped),
                         "their weight is 1/2"});
      return fused;
    }
  }
  return fail(ErrorKind::usage, "method", "unknown", "see fusion_method_names");
}

/// The fused luma with the visible image's colour differences.
cv::Mat colored(const Plane& fused, const cv::Mat& visible) {
  cv::Mat ycrcb;
  cv::cvtColor(visible, ycrcb, cv::COLOR_BGR2YCrCb);
  // Chroma of float images is centred on 0.5; shifted here by the same amount both ways.
  cv::insertChannel(fused, ycrcb, 0);
  cv::Mat bgr;
  cv::cvtColor(ycrcb, bgr, cv::COLOR_YCrCb2BGR);
  return bgr;
}

}  // namespace

const char* name(FusionMethod method) {
  for (const auto& [m, n] : methods)
    if (m == method) return n;
  return "?";
}

std::vector<std::string> fusion_method_names() {
  std::vector<std::string> names;
  for (const auto& [m, n] : methods) names.emplace_back(n);
  return names;
}

Result<FusionMethod> fusion_method(const std::string& wanted) {
  for (const auto& [m, n] : methods)
    if (wanted == n) return m;
  return fail(ErrorKind::usage, "method", "'" + wanted + "'",
              fmt::format("must be one of {}", fmt::join(fusion_method_names(), ", ")));
}

Status FusionOptions::validate() const {
  ORBITFUSE_TRY(best.validate());
  ORBITFUSE_TRY(ms_srif.validate());
  ORBITFUSE_TRY(pca_msif.validate());
  return cnn_lpif.validate();
}

Result<cv::Mat> fuse(const cv::Mat& visible, const cv::Mat& thermal, const cv::Mat& valid,
                     const FusionOptions& options, FusionReport* report) {
  const auto start = std::chrono::steady_clock::now();
  FusionReport own;
  FusionReport& said = report ? *report : own;
  said = {};
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_ASSIGN(const cv::Mat v, floats_of(visible, "visible"));
  ORBITFUSE_ASSIGN(const cv::Mat t, floats_of(thermal, "thermal"));
  const Plane v_luma = luma(v);
  Plane t_luma = luma(t);
  ORBITFUSE_TRY(fusion::check_pair(v_luma, t_luma));
  cv::Mat1b mask;
  if (!valid.empty()) {
    if (valid.type() != CV_8UC1 || valid.size() != visible.size())
      return fail(ErrorKind::input, "mask", fmt::format("{}x{}, type {}", valid.cols, valid.rows, valid.type()),
                  "must be 8-bit gray of the images' size");
    mask = valid > 0;
    const int count = cv::countNonZero(mask);
    if (count == 0)
      return fail(ErrorKind::input, "mask", "no valid pixel", "the thermal field does not cover this view");
    if (count == static_cast<int>(mask.total())) mask.release();
  }
  if (!mask.empty()) t_luma = filled(t_luma, mask);
  ORBITFUSE_ASSIGN(Plane fused, fuse_planes(v_luma, t_luma, options, said.skips));
  if (!mask.empty()) v_luma.copyTo(fused, ~mask);
  cv::Mat result = options.color && v.channels() == 3 ? colored(fused, v) : cv::Mat(fused), bytes;
  result.convertTo(bytes, CV_8U);
  said.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return bytes;
}

}  // namespace orbitfuse
