// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/scene_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "app/stages/metric_scale.hpp"
#include "app/view/shot_request.hpp"
#include "core/temperature.hpp"
#include "fusion/heat/heat.hpp"
#include "fusion/heat/legend.hpp"

namespace orbitfuse::view {
namespace {
using nlohmann::json;

/// "rrggbb" 256 times.
std::string hex_of(const cv::Mat& colors_bgr) {
  std::string text;
  for (int i = 0; i < colors_bgr.cols; ++i) {
    const auto& c = colors_bgr.at<cv::Vec3b>(0, i);
    text += fmt::format("{:02x}{:02x}{:02x}", c[2], c[1], c[0]);
  }
  return text;
}

/// The heat picture's scale: colours, and 256 times how strongly each is laid over the visible one,
/// "ss" of 255, both from the usual level to the hot one; and what comes of both over mid gray, for
/// its bar.
json heat_json(const FinishedRun& run) {
  const fusion::HeatOptions& how = run.config.fuse.options.heat;
  std::string strengths;
  for (int i = 0; i < 256; ++i) {
    const double level = run.heat.usual + (run.heat.hot - run.heat.usual) * i / 255;
    strengths += fmt::format("{:02x}", std::lround(255 * how.opacity * run.heat.strength(level)));
  }
  return {{"usual", run.heat.usual},
          {"hot", run.heat.hot},
          {"colors", hex_of(fusion::heat_colors(how.palette).value())},
          {"strengths", strengths},
          {"ramp", hex_of(fusion::heat_ramp({run.heat, {}, how}, 256).value())}};
}

}  // namespace

double surface_kelvin_per_count(const FinishedRun& run) {
  double hottest_k = 0;
  for (const float k : run.surface.temperatures_k)
    hottest_k = std::max(hottest_k, static_cast<double>(k));
  return orbitfuse::kelvin_per_count_for(hottest_k);
}

json scene_json(const FinishedRun& run) {
  json views = json::array();
  for (const RecordedView& recorded : run.views) {
    json view = browser_camera(recorded.view.camera, recorded.view.cam_from_world);
    view["modality"] = name(recorded.modality);
    view["name"] = recorded.view.name;
    view["width"] = recorded.view.camera.width;
    view["height"] = recorded.view.camera.height;
    if (recorded.doubt) view["doubt"] = *recorded.doubt;
    views.push_back(std::move(view));
  }
  json palettes = json::object();
  for (const std::string& palette_name : palette_names())
    palettes[palette_name] = hex_of(*palette(palette_name));
  const Eigen::Vector3d &c = run.center, &u = run.up;
  std::vector<std::string> notes = run.notes;
  notes.push_back(stages::scale_words(stages::scale_of_run(run.out)));
  std::error_code ignored;
  return {{"name", std::filesystem::weakly_canonical(run.out, ignored).string()},
          {"visible", run.has(Modality::visible)},
          {"thermal", run.has(Modality::thermal)},
          {"gray", run.thermal_is_gray},
          {"detail", run.has_detail()},
          {"span", {run.span.low_k, run.span.high_k}},
          {"heat", heat_json(run)},
          {"center", {c.x(), c.y(), c.z()}},
          {"up", {u.x(), u.y(), u.z()}},
          {"radius", run.radius},
          {"surface",
           {{"points", run.surface.size()},
            {"kelvin_per_count", surface_kelvin_per_count(run)},
            {"colored", !run.surface.colors.empty()},
            {"temperatures", !run.surface.temperatures_k.empty()}}},
          {"views", views},
          {"palettes", palettes},
          {"palette", run.config.render.palette},
          {"notes", notes}};
}

}  // namespace orbitfuse::view
