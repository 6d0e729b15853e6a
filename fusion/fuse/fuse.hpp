// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/progress.hpp"
#include "fusion/best/best.hpp"
#include "fusion/cnn_lpif/cnn_lpif.hpp"
#include "fusion/fuse/coloring.hpp"
#include "fusion/fuse/thermal_input.hpp"
#include "fusion/heat/heat.hpp"
#include "fusion/ms_srif/ms_srif.hpp"
#include "fusion/pca_msif/pca_msif.hpp"

// One aligned pair to one fused image, by any of the methods.
namespace orbitfuse {

enum class FusionMethod { heat, best, ms_srif, pca_msif, cnn_lpif };
const char* name(FusionMethod method);  ///< "heat", "best", "ms-srif", "pca-msif", "cnn-lpif"
std::vector<std::string> fusion_method_names();
Result<FusionMethod> fusion_method(const std::string& name);  ///< usage error with the known names

struct FusionOptions {
  /// Of a single pair. A run makes a picture by each of `fuse.methods` and shows the first of them
  /// first: heat, unless told otherwise.
  FusionMethod method = FusionMethod::best;
  /// The visible image's chroma is kept and its luma fused; off: the result is gray.
  bool color = true;
  TemperatureOverlay overlay;
  /// Of a thermal image in floats, see thermal_gray.
  std::optional<TemperatureSpan> span;
  /// Off: nothing is skipped but identical pairs; for measuring what skipping saves and loses.
  bool skip_unneeded = true;
  fusion::HeatOptions heat;
  fusion::BestOptions best;
  fusion::MsSrifOptions ms_srif;
  fusion::PcaMsifOptions pca_msif;
  fusion::CnnLpifOptions cnn_lpif;

  Status validate() const;
};

/// Shares of 0..1 that a method did not work on.
struct SkippedShares {
  double patches = 0;  ///< of those whose code or network weight the method asks for
  double pixels = 0;   ///< of the image: outside what holes leave, or in identical images
  double levels = 0;   ///< of the pyramid's bands
};

struct FusionReport {
  SkippedShares skipped;
  double unmeasured = 0;          ///< share of the image where the thermal one holds nothing
  std::optional<HeatScale> heat;  ///< by which heat coloured the image
  std::vector<Skip> skips;
  double wall_s = 0;
};

/// visible: CV_8U or CV_16U, 1 or 3 channels (BGR). thermal: gray, three channels, or floats such
/// as kelvin with NaN where there is nothing (see thermal_gray); of one size with visible, pixels
/// corresponding. valid: CV_8UC1, 0 where the thermal image holds nothing (a rendered hole); empty
/// = wherever it is finite. There the result is the visible image, into which the fused one fades
/// (see feathered), and the hole's values never reach its surroundings. Returns CV_8UC1, or CV_8UC3
/// with color, an overlay or by heat. Errors (input): types, sizes that differ, below 16 x 16
/// (heat: any size), no valid pixel; (usage): options.
Result<cv::Mat> fuse(const cv::Mat& visible, const cv::Mat& thermal, const cv::Mat& valid,
                     const FusionOptions& options, FusionReport* report = nullptr);

}  // namespace orbitfuse
