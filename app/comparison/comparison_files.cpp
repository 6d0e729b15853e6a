// SPDX-License-Identifier: BSD-3-Clause
#include "app/comparison/comparison_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "app/comparison/comparison_page.hpp"
#include "app/export/glb.hpp"
#include "core/formats/ply.hpp"
#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::comparison {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;

json regions_json(const std::vector<ComparedRegion>& regions, const exporting::ExportFrame& frame,
                  bool with_temperatures) {
  auto list = json::array();
  const double scale = frame.export_from_world.scale;
  for (const ComparedRegion& r : regions) {
    const Eigen::Vector3d center = frame.export_from_world * r.center;
    json j = {{"center", {center.x(), center.y(), center.z()}},
              {"area", r.area * scale * scale},
              {"vertices", r.vertices}};
    if (with_temperatures) {
      j["mean_k"] = r.mean_k;
      j["peak_k"] = r.peak_k;
      j["uncertainty_k"] = r.uncertainty_k;
    }
    list.push_back(std::move(j));
  }
  return list;
}

Result<exporting::ExportFrame> frame_of(const ComparedRuns& runs) {
  return exporting::export_frame(Eigen::Vector3d::Zero(), runs.scale);
}

/// The mesh in the export's frame, coloured by the difference.
TriangleMesh colored(const ComparedRuns& runs, const DifferenceColors& colors,
                     const exporting::ExportFrame& frame) {
  const Comparison& c = runs.comparison;
  TriangleMesh mesh = c.surface.mesh;
  mesh.vertices.temperatures_k = c.difference.difference_k;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const cv::Vec3b bgr = c.difference.change[v] == SurfaceChange::changed
                              ? DifferenceColors::changed
                              : colors.of(c.difference.difference_k[v]);
    mesh.vertices.colors[v] = {bgr[2], bgr[1], bgr[0]};
  }
  exporting::transform(frame, mesh);
  return mesh;
}

Status write_meshes(const fs::path& folder, const ComparedRuns& runs,
                    const DifferenceColors& colors) {
  ORBITFUSE_ASSIGN(const exporting::ExportFrame frame, frame_of(runs));
  TriangleMesh mesh = colored(runs, colors, frame);
  PlyWriteOptions ply;
  ply.temperature_name = "difference_k";
  ply.comments = {"after less before, kelvin; unit: " + frame.unit()};
  ORBITFUSE_TRY(write_ply(folder / "difference.ply", mesh, ply));
  mesh.vertices.temperatures_k.clear();  // a glTF reader would take differences for temperatures
  json extras = exporting::to_json(frame);
  extras["colors"] = {{"blue_k", -colors.reach_k()}, {"white_k", 0}, {"red_k", colors.reach_k()},
                      {"magenta", "changed geometry"}, {"gray", "not compared"}};
  return exporting::write_glb(folder / "difference.glb", mesh, extras);
}

/// AFTER as one of its cameras sees it, with the difference laid over.
Result<cv::Mat> picture(const ComparedRuns& runs, const PosedView& camera,
                        const DifferenceColors& colors, const CompareOptions& options,
                        const Progress& progress) {
  SurfaceDifferenceOptions fine = options.difference;
  fine.width_px = 480;
  ORBITFUSE_ASSIGN(const DifferencePicture seen,
                   difference_picture(camera, fields_of(runs.after), fields_of(runs.before),
                                      runs.comparison.registration.visible_from_thermal(), fine,
                                      progress));
  ORBITFUSE_ASSIGN(const nerf::RenderedView plain,
                   nerf::render(runs.after.visible, seen.view.camera, seen.view.cam_from_world, {},
                                progress));
  cv::Mat bgr;
  cv::cvtColor(plain.color, bgr, cv::COLOR_RGB2BGR);
  const double ambient = runs.comparison.ambient_removed ? runs.comparison.ambient_k : 0;
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x) {
      auto& pixel = bgr.at<cv::Vec3f>(y, x);
      const auto k = seen.difference_k.at<float>(y, x) - static_cast<float>(ambient);
      const bool changed = seen.only_here.at<std::uint8_t>(y, x) != 0;
      const double strength = changed ? 0.6 : colors.strength(k);
      const cv::Vec3b over = changed ? DifferenceColors::changed : colors.of(k);
      for (int c = 0; c < 3; ++c)
        pixel[c] = static_cast<float>((1 - strength) * 255 * std::clamp(pixel[c], 0.F, 1.F) +
                                      strength * over[c]);
    }
  bgr.convertTo(bgr, CV_8U);
  return bgr;
}

}  // namespace

json to_json(const ComparedRuns& runs) {
  const Comparison& c = runs.comparison;
  const auto frame = frame_of(runs);
  const exporting::ExportFrame world = frame ? *frame : exporting::ExportFrame{};
  const auto path = [](const view::FinishedRun& run) {
    return fs::absolute(run.out).lexically_normal().string();
  };
  return {{"schema", 1},
          {"before", path(runs.before)},
          {"after", path(runs.after)},
          {"frame", exporting::to_json(world)},
          {"registration",
           {{"score", c.registration.clouds.score},
            {"rmse_percent_of_diameter", c.registration.clouds.rmse_percent_of_diameter},
            {"edges", c.registration.images.agreement_after},
            {"after_scale_of_before", c.registration.visible_from_thermal().scale}}},
          {"ambient_k", c.ambient_k},
          {"ambient_removed", c.ambient_removed},
          {"noise_k", c.noise_k},
          {"share", {{"compared", c.same_share},
                     {"changed", c.changed_share},
                     {"not_seen", c.unseen_share},
                     {"beyond_least", c.beyond_share}}},
          {"differences", regions_json(c.warmer_or_colder, world, true)},
          {"appeared", regions_json(c.appeared, world, false)},
          {"gone", regions_json(c.gone, world, false)}};
}

Status write_comparison(const fs::path& folder, const ComparedRuns& runs,
                        const CompareOptions& options, const Progress& progress) {
  const DifferenceColors colors(runs.comparison);
  ORBITFUSE_TRY(write_meshes(folder, runs, colors));
  std::vector<ComparedPicture> pictures;
  const std::vector<PosedView> cameras = fields_of(runs.after).visible_views;
  constexpr std::size_t most_pictures = 6;
  const std::size_t step = std::max<std::size_t>(1, cameras.size() / most_pictures);
  for (std::size_t i = 0; i < cameras.size() && pictures.size() < most_pictures; i += step) {
    ORBITFUSE_TRY(progress.check("compare"));
    ORBITFUSE_ASSIGN(const cv::Mat image, picture(runs, cameras[i], colors, options, progress));
    const std::string name = fs::path(cameras[i].name).stem().string();
    ORBITFUSE_TRY(write_png(folder / "views" / (name + ".png"), image));
    pictures.push_back({cameras[i].name, image});
  }
  const json numbers = to_json(runs);
  ORBITFUSE_TRY(write_file_atomic(folder / "comparison.html",
                                  comparison_page(numbers, colors, pictures)));
  return write_file_atomic(folder / "differences.json", numbers.dump(2) + "\n");
}

}  // namespace orbitfuse::comparison
