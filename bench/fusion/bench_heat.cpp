// SPDX-License-Identifier: BSD-3-Clause
// Whether the heat pictures of finished runs show what is warm: rank correlation of colour strength
// with temperature above the surroundings, over the object's pixels of each view.
//   bench_heat RUN...
// RUN: --out folder of `orbitfuse run` with fuse.method heat among its methods (the default).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "app/stages/artifacts.hpp"
#include "app/stages/rendered_views.hpp"
#include "bench/exit_status.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/image/image_io.hpp"
#include "core/numeric/median.hpp"
#include "core/numeric/rank_correlation.hpp"
#include "core/temperature.hpp"
#include "recon/assembly/looked_at.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;

/// How far each pixel's colour moved, in CIELAB.
cv::Mat color_strength(const cv::Mat& visible, const cv::Mat& heat) {
  cv::Mat lab[2];
  const cv::Mat* pictures[] = {&visible, &heat};
  for (int i = 0; i < 2; ++i) {
    pictures[i]->convertTo(lab[i], CV_32F, 1 / 255.0);
    cv::cvtColor(lab[i], lab[i], cv::COLOR_BGR2Lab);
  }
  const cv::Mat moved = lab[1] - lab[0];
  cv::Mat strength(moved.size(), CV_32FC1);
  for (int y = 0; y < moved.rows; ++y)
    for (int x = 0; x < moved.cols; ++x)
      strength.at<float>(y, x) = static_cast<float>(cv::norm(moved.at<cv::Vec3f>(y, x)));
  return strength;
}

/// What one view has, of the object's measured pixels.
struct ViewSamples {
  std::vector<float> strength, above_k;  ///< 0 K: as warm as the surroundings, or colder
  /// Of those that are warmer than the surroundings alone.
  ViewSamples warmer() const {
    ViewSamples result;
    for (std::size_t i = 0; i < above_k.size(); ++i)
      if (above_k[i] > 0) {
        result.strength.push_back(strength[i]);
        result.above_k.push_back(above_k[i]);
      }
    return result;
  }
  double correlation() const { return rank_correlation(strength, above_k); }
};

Result<std::vector<ViewSamples>> samples_of(const fs::path& run) {
  const fs::path folder = run / "render";
  ORBITFUSE_ASSIGN(const stages::RenderedViews rendered, stages::load_rendered_views(folder));
  ORBITFUSE_ASSIGN(const Transforms cameras, read_transforms_json(folder / "transforms.json"));
  ORBITFUSE_ASSIGN(const Reconstruction orbit,
                   stages::load_poses(run / "poses_visible", Modality::visible));
  if (!rendered.has_both() || cameras.frames.size() != rendered.views.size())
    return fail(ErrorKind::input, folder.string(), "no views of both modalities",
                "name a run with both");
  std::vector<ThermalView> views;
  for (std::size_t i = 0; i < rendered.views.size(); ++i) {
    const stages::ViewFiles& files = rendered.views[i];
    ORBITFUSE_ASSIGN(cv::Mat thermal, field_image(folder / files.thermal, rendered.samples()));
    ORBITFUSE_ASSIGN(const cv::Mat measured,
                     read_image(run / "fuse/measured" / (files.name + ".png")));
    thermal.setTo(std::nanf(""), measured == 0);
    ORBITFUSE_ASSIGN(const cv::Mat depth, read_float_tiff(folder / files.depth));
    views.push_back({{files.name, cameras.frames[i].camera, cameras.frames[i].cam_from_world},
                     std::move(thermal),
                     depth});
  }
  const std::vector<cv::Mat> of_object = within_orbit(views, orbit.views, object_reach);
  std::vector<ViewSamples> result;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string& name = rendered.views[i].name;
    ORBITFUSE_ASSIGN(const cv::Mat visible, read_visible(folder / rendered.views[i].visible));
    ORBITFUSE_ASSIGN(const cv::Mat heat, read_visible(run / "fuse/heat" / (name + ".png")));
    const cv::Mat strength = color_strength(visible, heat);
    ViewSamples samples;
    for (int y = 0; y < strength.rows; ++y)
      for (int x = 0; x < strength.cols; ++x) {
        const float level = of_object[i].at<float>(y, x);
        if (!std::isfinite(level)) continue;
        samples.strength.push_back(strength.at<float>(y, x));
        samples.above_k.push_back(std::max(0.0F, level - static_cast<float>(rendered.heat.usual)));
      }
    result.push_back(std::move(samples));
  }
  return result;
}

Status report(const fs::path& run) {
  ORBITFUSE_ASSIGN(const std::vector<ViewSamples> views, samples_of(run));
  std::vector<double> all, warmer;
  double share = 0;
  ViewSamples together;
  for (const ViewSamples& view : views) {
    const ViewSamples above = view.warmer();
    all.push_back(view.correlation());
    warmer.push_back(above.correlation());
    share += static_cast<double>(above.above_k.size()) / static_cast<double>(view.above_k.size());
    together.strength.insert(together.strength.end(), above.strength.begin(), above.strength.end());
    together.above_k.insert(together.above_k.end(), above.above_k.begin(), above.above_k.end());
  }
  fmt::print("| `{}` | {} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.0f} % |\n",
             run.filename().string(), views.size(), together.correlation(), median(warmer),
             *std::min_element(warmer.begin(), warmer.end()), median(all),
             *std::min_element(all.begin(), all.end()),
             100 * share / static_cast<double>(views.size()));
  return {};
}

}  // namespace
}  // namespace orbitfuse

int main(int argc, char** argv) {
  CLI::App app(
      "Rank correlation of heat's colour strength with temperature above the surroundings");
  std::vector<std::string> runs;
  app.add_option("runs", runs, "--out folders of finished runs")->required();
  CLI11_PARSE(app, argc, argv);
  fmt::print(
      "| scene | views | warmer pixels, all views as one | median view | worst view | all pixels, "
      "median view | worst view | of them warmer |\n|---|---|---|---|---|---|---|---|\n");
  for (const std::string& run : runs)
    if (const int failed = orbitfuse::exit_status(orbitfuse::report(run))) return failed;
  return 0;
}
