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
  HeatScaleOptions options;
  if (samples == Samples::gray) options.min_width = min_heat_gray_levels;
  return options;
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
  return write_json(folder / views_file,
                    {{"schema", 1},
                     {"conventions",
                      "thermal: 16-bit, kelvin = scale * count as the tag says (0.01 below 382 C); "
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
  ORBITFUSE_ASSIGN(const json j, read_json(folder / views_file));
  RenderedViews rendered;
  try {
    j.at("thermal_is_gray").get_to(rendered.thermal_is_gray);
    j.at("span_low").get_to(rendered.span.low_k);
    j.at("span_high").get_to(rendered.span.high_k);
    const json& heat = j.at("heat");
    heat.at("usual").get_to(rendered.heat.usual);
    heat.at("spread").get_to(rendered.heat.spread);
    heat.at("hot").get_to(rendered.heat.hot);
    for (const json& v : j.at("views")) {
      ViewFiles view;
      visit_files(
          view, [&](const char* key, std::string& value) { value = v.value(key, std::string()); });
      rendered.views.push_back(std::move(view));
    }
  } catch (const json::exception& e) {
    return fail(ErrorKind::input, (folder / views_file).string(), e.what(),
                "run the render stage again");
  }
  return rendered;
}

}  // namespace orbitfuse::stages
