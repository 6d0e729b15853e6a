// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/fuse/fuse.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "fusion/fuse/holes.hpp"

namespace orbitfuse {
namespace {

using fusion::Plane;

constexpr std::pair<FusionMethod, const char*> methods[] = {{FusionMethod::heat, "heat"},
                                                            {FusionMethod::best, "best"},
                                                            {FusionMethod::ms_srif, "ms-srif"},
                                                            {FusionMethod::pca_msif, "pca-msif"},
                                                            {FusionMethod::cnn_lpif, "cnn-lpif"}};

/// The options with everything that skips work switched off.
FusionOptions without_skipping(FusionOptions options) {
  options.ms_srif.certain_ratio = options.ms_srif.residual = options.ms_srif.relative_residual = 0;
  options.cnn_lpif.same_within = options.cnn_lpif.flat_within = -1;
  return options;
}

/// Percentages as the user reads them, where anything was skipped.
void tell_levels(double share, FusionReport& said) {
  said.skipped.levels = share;
  if (share > 0)
    said.skips.push_back({"pyramid levels",
                          fmt::format("{:.0f} % hold nothing in both images", 100 * share),
                          "their bands are not fused"});
}

Result<Plane> by_best(const Plane& visible, const Plane& thermal, const FusionOptions& options,
                      FusionReport& said) {
  fusion::BestReport report;
  auto fused = fusion::fuse_best(visible, thermal, options.best, &report);
  tell_levels(report.levels_skipped, said);
  return fused;
}

Result<Plane> by_ms_srif(const Plane& visible, const Plane& thermal, const FusionOptions& options,
                         FusionReport& said) {
  fusion::MsSrifReport report;
  auto fused = fusion::fuse_ms_srif(visible, thermal, options.ms_srif, &report);
  const int spared = report.flat_patches + report.certain_patches;
  if (report.patches > 0) said.skipped.patches = static_cast<double>(spared) / report.patches;
  if (spared > 0)
    said.skips.push_back({"sparse codes",
                          fmt::format("{} of {} patches are decided by their DCT, {} are flat",
                                      report.certain_patches, report.patches, report.flat_patches),
                          fmt::format("{:.1f} atoms a patch of at most {}", report.atoms_per_patch,
                                      options.ms_srif.max_atoms)});
  tell_levels(report.levels_skipped, said);
  return fused;
}

Result<Plane> by_cnn_lpif(const Plane& visible, const Plane& thermal, const FusionOptions& options,
                          FusionReport& said) {
  fusion::CnnLpifReport report;
  auto fused = fusion::fuse_cnn_lpif(visible, thermal, options.cnn_lpif, &report);
  said.skipped.patches = report.patches_skipped;
  if (report.patches_skipped > 0)
    said.skips.push_back({"network",
                          fmt::format("{:.1f} % of the patches are alike or flat in one image",
                                      100 * report.patches_skipped),
                          "their weights are known without it"});
  tell_levels(report.levels_skipped, said);
  return fused;
}

Result<Plane> fuse_planes(const Plane& visible, const Plane& thermal, const FusionOptions& options,
                          FusionReport& said) {
  ORBITFUSE_TRY(fusion::check_pair(visible, thermal));
  if (fusion::differing_share(visible, thermal, 0) == 0) {
    said.skipped = {1, 1, 1};
    said.skips.push_back(
        {"fusion", "the two images are identical", "the result is the image itself"});
    return visible;
  }
  const FusionOptions chosen = options.skip_unneeded ? options : without_skipping(options);
  switch (chosen.method) {
    case FusionMethod::heat:
      break;  // no fusion of planes: see by_heat
    case FusionMethod::best:
      return by_best(visible, thermal, chosen, said);
    case FusionMethod::ms_srif:
      return by_ms_srif(visible, thermal, chosen, said);
    case FusionMethod::pca_msif:
      return fusion::fuse_pca_msif(visible, thermal, chosen.pca_msif);
    case FusionMethod::cnn_lpif:
      return by_cnn_lpif(visible, thermal, chosen, said);
  }
  return fail(ErrorKind::usage, "method", "unknown", "see fusion_method_names");
}

/// Fuses what holes leave of the pair; elsewhere the visible image.
Result<Plane> fuse_valid(const Plane& visible, const Plane& thermal, const cv::Mat1b& valid,
                         const Plane& measured, const FusionOptions& options, FusionReport& said) {
  if (valid.empty()) return fuse_planes(visible, thermal, options, said);
  const cv::Rect part = options.skip_unneeded ? needed_part(valid) : cv::Rect({}, valid.size());
  const double outside = 1 - static_cast<double>(part.area()) / static_cast<double>(valid.total());
  if (outside > 0)
    said.skips.push_back({"pixels far from any thermal one",
                          fmt::format("{:.0f} % of the image", 100 * outside),
                          "the visible image is shown there"});
  const Plane filled_part = filled(thermal, valid)(part).clone();
  ORBITFUSE_ASSIGN(const Plane fused,
                   fuse_planes(visible(part).clone(), filled_part, options, said));
  said.skipped.pixels = std::max(said.skipped.pixels, outside);
  Plane result = visible.clone();
  result(part) += measured(part).mul(fused - visible(part));
  return result;
}

Status check_sizes(const cv::Mat& visible, const cv::Mat& thermal) {
  if (visible.empty()) return fail(ErrorKind::input, "visible", "no pixels", "give an image");
  if (visible.size() == thermal.size()) return {};
  return fail(ErrorKind::input, "thermal",
              fmt::format("{}x{} pixels, the visible image has {}x{}", thermal.cols, thermal.rows,
                          visible.cols, visible.rows),
              "register or resize the pair first: pixels must correspond");
}

Result<cv::Mat> by_heat(const cv::Mat& visible, const Plane& levels, const cv::Mat1b& valid,
                        const Plane& measured, const FusionOptions& options, bool gray_levels,
                        FusionReport& said) {
  fusion::HeatOptions chosen = options.heat;
  if (!chosen.scale) {
    Plane seen = levels.clone();
    if (!valid.empty()) seen.setTo(std::numeric_limits<float>::quiet_NaN(), ~valid);
    chosen.scale =
        heat_scale({seen}, gray_levels ? HeatScaleOptions::of_gray_levels() : HeatScaleOptions{});
  }
  said.heat = chosen.scale;
  cv::Mat bgr = options.color ? visible : cv::Mat(luma(visible));
  if (bgr.channels() == 1) cv::cvtColor(bgr, bgr, cv::COLOR_GRAY2BGR);
  return fusion::colored_by_heat(bgr, levels, measured, chosen);
}

/// Both sources of validity in one mask, empty where everything is valid.
Result<cv::Mat1b> joint_mask(const cv::Mat& given, const cv::Mat1b& finite, cv::Size size) {
  cv::Mat1b mask = finite;
  if (!given.empty()) {
    if (given.type() != CV_8UC1 || given.size() != size)
      return fail(
          ErrorKind::input, "mask",
          fmt::format("{}x{}, {} channel{} of {} bits", given.cols, given.rows, given.channels(),
                      given.channels() == 1 ? "" : "s", 8 * given.elemSize1()),
          fmt::format("must be {}x{}, 8-bit gray", size.width, size.height));
    mask = given > 0;
    if (!finite.empty()) mask &= finite;
  }
  if (mask.empty()) return mask;
  const int count = cv::countNonZero(mask);
  if (count == 0)
    return fail(ErrorKind::input, "mask", "no valid pixel",
                "the thermal field does not cover this view");
  return count == static_cast<int>(mask.total()) ? cv::Mat1b() : mask;
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
  ORBITFUSE_TRY(heat.validate());
  ORBITFUSE_TRY(best.validate());
  ORBITFUSE_TRY(ms_srif.validate());
  ORBITFUSE_TRY(pca_msif.validate());
  ORBITFUSE_TRY(overlay.validate());
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
  ORBITFUSE_ASSIGN(const ThermalGray t, thermal_gray(thermal, options.span));
  ORBITFUSE_TRY(check_sizes(v, t.gray));
  const Plane v_luma = luma(v);
  if (options.method != FusionMethod::heat) ORBITFUSE_TRY(fusion::check_pair(v_luma, t.gray));
  ORBITFUSE_ASSIGN(const cv::Mat1b mask, joint_mask(valid, t.valid, visible.size()));
  const Plane measured = mask.empty() ? Plane() : feathered(mask);
  if (!mask.empty())
    said.unmeasured =
        1 - static_cast<double>(cv::countNonZero(mask)) / static_cast<double>(mask.total());
  cv::Mat result;
  if (options.method == FusionMethod::heat) {
    const bool gray_levels = thermal.depth() != CV_32F;
    ORBITFUSE_ASSIGN(result, by_heat(v, gray_levels ? t.gray : Plane(thermal), mask, measured,
                                     options, gray_levels, said));
  } else {
    ORBITFUSE_ASSIGN(result, fuse_valid(v_luma, t.gray, mask, measured, options, said));
    if (!options.overlay.palette.empty() || (options.color && v.channels() == 3)) {
      ORBITFUSE_ASSIGN(result, colored(result, options.color ? v : cv::Mat(v_luma), t.gray,
                                       measured, options.overlay));
    }
  }
  cv::Mat bytes;
  result.convertTo(bytes, CV_8U);
  said.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return bytes;
}

}  // namespace orbitfuse
