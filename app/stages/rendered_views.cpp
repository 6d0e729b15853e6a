// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/rendered_views.hpp"

#include <opencv2/imgproc.hpp>

#include "app/stages/artifacts.hpp"

namespace orbitfuse::stages {
using nlohmann::json;

namespace {

constexpr const char* views_file = "views.json";

/// The file fields of a view by their JSON names.
template <class View, class Visit>
void visit_files(View& view, Visit visit) {
  visit("name", view.name);
  visit("visible", view.visible);
  visit("thermal", view.thermal);
  visit("palette", view.palette);
  visit("depth", view.depth);
  visit("visible_opacity", view.visible_opacity);
  visit("thermal_opacity", view.thermal_opacity);
}

}  // namespace

cv::Mat bgr8_of_rgb(const cv::Mat& rgb) {
  cv::Mat known = rgb.clone(), bytes, bgr;
  cv::patchNaNs(known, 0);
  known.convertTo(bytes, CV_8U, 255.0);
  cv::cvtColor(bytes, bgr, cv::COLOR_RGB2BGR);
  return bgr;
}

HeatScaleOptions heat_scale_options(Samples samples) {
  return samples == Samples::gray ? HeatScaleOptions::of_gray_levels() : HeatScaleOptions{};
}

Status save_rendered_views(const std::filesystem::path& folder, const RenderedViews& rendered) {
  json views = json::array();
  for (const ViewFiles& view : rendered.views) {
    json j = json::object();
    visit_files(view, [&](const char* key, const std::string& value) {
      if (!value.empty()) j[key] = value;
    });
    views.push_back(std::move(j));
  }
  return write_json(
      folder / views_file,
      {{"schema", 1},
       {"conventions", std::string(rendered.thermal_is_gray
                                       ? "thermal: 8-bit gray levels, no temperatures; "
                                       : "thermal: 16-bit, kelvin = scale * count as the tag says "
                                         "(0.01 below 382 C); ") +
                           "depth: along the optical axis, "
                           "units of the visible reconstruction; poses in transforms.json"},
       {"thermal_is_gray", rendered.thermal_is_gray},
       {"span_low", rendered.span.low_k},
       {"span_high", rendered.span.high_k},
       {"heat",
        {{"usual", rendered.heat.usual},
         {"spread", rendered.heat.spread},
         {"hot", rendered.heat.hot}}},
       {"views", views}});
}

Result<RenderedViews> load_rendered_views(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / views_file;
  ORBITFUSE_ASSIGN(const json j, read_json(file));
  const JsonFields fields = stage_fields(j, file);
  RenderedViews rendered;
  ORBITFUSE_TRY(fields.get_all("thermal_is_gray", rendered.thermal_is_gray, "span_low",
                               rendered.span.low_k, "span_high", rendered.span.high_k));
  ORBITFUSE_ASSIGN(const JsonFields heat, fields.child("heat"));
  ORBITFUSE_TRY(heat.get_all("usual", rendered.heat.usual, "spread", rendered.heat.spread, "hot",
                             rendered.heat.hot));
  ORBITFUSE_ASSIGN(const std::vector<JsonFields> views, fields.children("views"));
  for (const JsonFields& entry : views) {
    ViewFiles view;
    Status read;
    visit_files(view, [&](const char* key, std::string& value) {
      if (read) read = entry.get_present(key, value);
    });
    ORBITFUSE_TRY(read);
    rendered.views.push_back(std::move(view));
  }
  return rendered;
}

}  // namespace orbitfuse::stages
