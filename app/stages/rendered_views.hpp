// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/image/palette.hpp"
#include "core/result.hpp"
#include "fusion/heat/legend.hpp"
#include "recon/assembly/training_data.hpp"

namespace orbitfuse::stages {

/// Files of one new view, relative to the render stage's folder; empty = not rendered.
struct ViewFiles {
  std::string name;
  std::string visible, thermal, palette, depth, visible_opacity, thermal_opacity;
};

struct RenderedViews {
  std::vector<ViewFiles> views;
  TemperatureSpan span;  ///< one for all views; gray levels when thermal_is_gray
  HeatScale heat;        ///< likewise
  bool thermal_is_gray = false;

  /// What the thermal files hold.
  Samples samples() const { return thermal_is_gray ? Samples::gray : Samples::kelvin; }
  fusion::HeatUnit heat_unit() const {
    return thermal_is_gray ? fusion::HeatUnit::gray : fusion::HeatUnit::kelvin;
  }
  bool has_both() const {
    return !views.empty() && !views[0].visible.empty() && !views[0].thermal.empty();
  }
};

/// Least width of a scale: 2 K, or the gray levels that noise doesn't reach.
HeatScaleOptions heat_scale_options(Samples samples);

/// A rendered colour (CV_32FC3, R, G, B in 0..1; NaN becomes black) as a picture, CV_8UC3 BGR.
cv::Mat bgr8_of_rgb(const cv::Mat& rgb);

Status save_rendered_views(const std::filesystem::path& folder, const RenderedViews& views);
Result<RenderedViews> load_rendered_views(const std::filesystem::path& folder);

}  // namespace orbitfuse::stages
