// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/fuse/fuse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "app/stages/artifacts.hpp"
#include "app/stages/metric_tables.hpp"
#include "app/stages/rendered_views.hpp"
#include "app/stages/stage_list.hpp"
#include "core/image/image_io.hpp"
#include "core/numeric/percent.hpp"
#include "core/system/side_by_side.hpp"
#include "fusion/heat/legend.hpp"
#include "recon/assembly/training_data.hpp"

namespace orbitfuse::stages {
namespace {
using nlohmann::json;
using pipeline::StageContext;
using pipeline::StageOutput;

/// 255 where both fields have something to show.
Result<cv::Mat> valid_pixels(const std::filesystem::path& folder, const ViewFiles& files,
                             const cv::Mat& thermal, double min_opacity) {
  ORBITFUSE_ASSIGN(const cv::Mat visible_opacity, read_float_tiff(folder / files.visible_opacity));
  ORBITFUSE_ASSIGN(const cv::Mat thermal_opacity, read_float_tiff(folder / files.thermal_opacity));
  cv::Mat valid =
      (thermal == thermal) & (visible_opacity >= min_opacity) & (thermal_opacity >= min_opacity);
  return valid;
}

/// One view by one method. Gray fusion takes the thermal image over the run's span; heat the levels
/// themselves, which a span would cut.
Result<cv::Mat> fuse_view(const cv::Mat& visible, const cv::Mat& thermal, const cv::Mat& valid,
                          const RenderedViews& rendered, FusionOptions options,
                          FusionReport& said) {
  if (cv::countNonZero(valid) == 0) return visible;
  if (options.method != FusionMethod::heat)
    return fuse(visible, gray_of_kelvin(thermal, rendered.span), valid, options, &said);
  options.heat.scale = rendered.heat;
  options.span = rendered.span;
  return fuse(visible, thermal, valid, options, &said);
}

/// The bar that says what heat's colours stand for, beside its pictures.
Status write_legend(const StageContext& context, const RenderedViews& rendered,
                    const FusionOptions& options) {
  constexpr int width_px = 640;
  ORBITFUSE_ASSIGN(
      const cv::Mat legend,
      fusion::heat_legend({rendered.heat, rendered.heat_unit(), options.heat}, width_px));
  return write_png(context.folder / "heat_legend.png", legend);
}

Result<StageOutput> fuse_views(const StageContext& context, const RunConfig& config) {
  const auto folder = context.of("render");
  ORBITFUSE_ASSIGN(const RenderedViews rendered, load_rendered_views(folder));
  ORBITFUSE_ASSIGN(const auto methods, config.fuse.chosen());
  StageOutput output;
  std::map<std::string, double> wall_s;
  int fused_images = 0;
  json measured = json::object();
  double measured_sum = 0;
  for (const ViewFiles& files : rendered.views) {
    ORBITFUSE_TRY(context.progress.check("fuse"));
    context.progress.report({"fuse",
                             static_cast<double>(fused_images),
                             static_cast<double>(rendered.views.size() * methods.size()),
                             {},
                             files.name});
    ORBITFUSE_ASSIGN(const cv::Mat visible, read_visible(folder / files.visible));
    ORBITFUSE_ASSIGN(const cv::Mat thermal,
                     field_image(folder / files.thermal, rendered.samples()));
    ORBITFUSE_ASSIGN(const cv::Mat valid,
                     valid_pixels(folder, files, thermal, config.render.min_opacity));
    std::vector<std::function<Status()>> writes;
    const auto write = [&](const std::string& kind, cv::Mat image) {
      const auto file = context.folder / kind / (files.name + ".png");
      writes.emplace_back([file, image = std::move(image)] { return write_png(file, image); });
    };
    write("thermal", gray_of_kelvin(thermal, rendered.span));
    write("measured", valid);
    const double share =
        static_cast<double>(cv::countNonZero(valid)) / static_cast<double>(valid.total());
    measured[files.name] = share;
    measured_sum += share;
    for (const FusionMethod method : methods) {
      FusionOptions options = config.fuse.options;
      options.method = method;
      FusionReport said;
      const auto image = fuse_view(visible, thermal, valid, rendered, options, said);
      if (!image) return tl::unexpected(image.error());
      write(name(method), *image);
      wall_s[name(method)] += said.wall_s;
      ++fused_images;
      if (&files == &rendered.views.front())
        for (Skip& skip : said.skips) {
          skip.what = std::string(name(method)) + ": " + skip.what + " (first view)";
          output.skips.push_back(skip);
        }
    }
    ORBITFUSE_TRY(side_by_side(writes));
    if (cv::countNonZero(valid) == 0)
      output.warnings.push_back(
          files.name + ": the thermal field does not cover this view; the visible one is shown");
  }
  json list = json::array(), times = json::object();
  for (const FusionMethod method : methods) {
    list.push_back(name(method));
    times[name(method)] = 1000 * wall_s[name(method)] / static_cast<double>(rendered.views.size());
  }
  if (std::count(methods.begin(), methods.end(), FusionMethod::heat) > 0)
    ORBITFUSE_TRY(write_legend(context, rendered, config.fuse.options));
  const double measured_share = measured_sum / static_cast<double>(rendered.views.size());
  output.metrics = {
      {"brief", fmt::format("{} images by {} methods, {} of the pixels seen by the thermal field",
                            fused_images, methods.size(), percent(measured_share))},
      {"methods", list},
      {"milliseconds_a_view", times},
      {"measured_share", measured_share},
      {"measured_share_by_view", measured}};
  return output;
}

}  // namespace

pipeline::Stage fuse_stage(const StageInputs& in) {
  pipeline::Stage stage;
  stage.name = "fuse";
  stage.version = 4;
  stage.needs = {"render"};
  stage.options = in.config->settings().to_json("fuse");
  stage.options["min_opacity"] = in.config->render.min_opacity;
  for (const Modality modality : {Modality::visible, Modality::thermal})
    if (!in.session->has(modality))
      stage.pointless = fmt::format("the session has no {} frames", name(modality));
  stage.absent = [](const StageContext& context) -> std::optional<std::string> {
    if (!context.has("render")) return "nothing was rendered";
    const auto rendered = load_rendered_views(context.of("render"));
    if (rendered && rendered->has_both()) return std::nullopt;
    return "only one modality was rendered";
  };
  stage.run = [in](const StageContext& context) { return fuse_views(context, *in.config); };
  return stage;
}

}  // namespace orbitfuse::stages
