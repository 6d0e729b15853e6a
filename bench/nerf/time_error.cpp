// SPDX-License-Identifier: BSD-3-Clause
// nerf_time_error --scene container --data ../shared/data/orbits [--set key=value ...]
// Trains one field and prints its error against run time.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

#include "bench/nerf/scenes.hpp"
#include "core/cpu.hpp"
#include "core/image_io.hpp"
#include "core/parallel.hpp"
#include "recon/depth/dense_depth.hpp"
#include "recon/nerf/nerf.hpp"

namespace {

using namespace orbitfuse;

struct Arguments {
  std::string scene = "fox", preset, data = "../shared/data/orbits", model, images, field, guide;
  std::vector<std::string> set;
  int threads = 0;
  bool quick = false, depth = false, train = true;
  depth::DepthOptions depth_options;
};

/// Dense depth of the training views; its time is printed beside the training's.
Status add_depth(nerf::Dataset& data, const depth::DepthOptions& options, const std::string& folder) {
  Reconstruction model;
  std::vector<cv::Mat> images;
  std::vector<int> index;
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    const nerf::TrainingView& view = data.views[i];
    if (view.measure_only) continue;
    cv::Mat bytes;
    view.image.convertTo(bytes, CV_8UC3, 255);
    images.push_back(bytes);  // R, G, B order: only its gray matters
    model.views.push_back({view.name, view.camera, view.cam_from_world});
    index.push_back(static_cast<int>(i));
  }
  const auto cpu = [] { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; };
  const double start = cpu();
  ORBITFUSE_ASSIGN(depth::DenseDepth found, depth::dense_depth(model, images, options, {}));
  fmt::print("depth: {:.1f} CPU s, {:.1f} % of the pixels matched, {:.1f} % confirmed\n", cpu() - start,
             100 * found.report.matched, 100 * found.report.known);
  for (DepthMap& map : found.maps) {
    if (!folder.empty()) {
      cv::Mat picture;
      cv::Mat(1 / map.depth).convertTo(picture, CV_8U, 255 * 4);
      ORBITFUSE_TRY(write_png(fmt::format("{}/depth_{:03d}.png", folder, map.view), picture));
    }
    map.view = index[static_cast<std::size_t>(map.view)];
    data.depth.push_back(std::move(map));
  }
  return {};
}

struct TestError {
  double psnr_db = 0, mae_k = 0;
};

/// PSNR over the modality's span; thermal MAE over pixels above 0 C.
Result<TestError> test_error(const nerf::Field& field, const nerf::Dataset& data,
                             const std::string& images) {
  double psnr = 0, mae = 0;
  int views = 0;
  double low = 1e9, high = -1e9;
  for (const auto& view : data.views) {
    double a, b;
    cv::minMaxLoc(view.image.reshape(1), &a, &b);
    low = std::min(low, a);
    high = std::max(high, b);
  }
  const bool thermal = data.modality == Modality::thermal;
  const double span = thermal ? high - low : 1.0;
  for (const auto& view : data.views) {
    if (!view.measure_only) continue;
    ORBITFUSE_ASSIGN(const nerf::RenderedView out,
                     nerf::render(field, view.camera, view.cam_from_world, {}, {}));
    const cv::Mat truth = view.image.reshape(1), found = out.color.reshape(1);
    double squared = 0, absolute = 0;
    long count = 0, scene = 0;
    for (int y = 0; y < truth.rows; ++y)
      for (int x = 0; x < truth.cols; ++x) {
        const double error = found.at<float>(y, x) - truth.at<float>(y, x);
        if (!std::isfinite(error)) continue;
        squared += error * error;
        ++count;
        if (truth.at<float>(y, x) > 273.15) {
          absolute += std::abs(error);
          ++scene;
        }
      }
    psnr += 10 * std::log10(span * span * static_cast<double>(count) / squared);
    mae += absolute / static_cast<double>(std::max(1l, scene));
    ++views;
    if (!images.empty()) {
      cv::Mat picture;
      if (thermal)
        out.color.convertTo(picture, CV_8U, 255 / (high - low), -255 * low / (high - low));
      else
        cv::Mat(out.color * 255).convertTo(picture, CV_8UC3);
      if (!thermal) {
        for (auto p = picture.begin<cv::Vec3b>(); p != picture.end<cv::Vec3b>(); ++p)
          std::swap((*p)[0], (*p)[2]);
      }
      ORBITFUSE_TRY(write_png(fmt::format("{}/{}.png", images, view.name), picture));
      cv::Mat depth;
      out.depth.convertTo(depth, CV_8U, 25);
      ORBITFUSE_TRY(write_png(fmt::format("{}/{}_depth.png", images, view.name), depth));
    }
  }
  return TestError{psnr / views, mae / views};
}

Status run(const Arguments& a) {
  set_thread_count(a.threads);
  ORBITFUSE_ASSIGN(nerf::Dataset data, bench::load_scene(a.scene, a.data, a.model));
  ORBITFUSE_ASSIGN(nerf::TrainOptions options,
                   nerf::preset(a.preset.empty() ? nerf::default_preset(data.modality) : a.preset));
  options.keep_best = false;  // the measured views are the test split: nothing is chosen on them
  for (const std::string& assignment : a.set) {
    const auto at = assignment.find('=');
    if (at == std::string::npos) return fail(ErrorKind::usage, "--set", assignment, "give key=value");
    ORBITFUSE_TRY(options.set(assignment.substr(0, at), assignment.substr(at + 1)));
  }
  fmt::print("{}, {} threads, {}, {}\n", cpu_description(), thread_count(), name(best_isa()), a.scene);
  if (a.depth) ORBITFUSE_TRY(add_depth(data, a.depth_options, a.images));
  if (!a.train) return {};
  nerf::Field field;
  nerf::Field guide;
  if (!a.guide.empty()) {
    ORBITFUSE_ASSIGN(guide, nerf::Field::load(a.guide));
    options.shared_geometry = true;
  }
  ORBITFUSE_ASSIGN(const nerf::TrainReport report,
                   nerf::train(data, options, {}, field, guide.empty() ? nullptr : &guide));
  for (const auto& p : report.curve)
    fmt::print("step {:5d}  cpu {:7.1f} s  wall {:7.1f} s  held-out {:6.2f} dB  train {:6.2f} dB  {:6.1f} samples/ray\n",
               p.step, p.cpu_s, p.wall_s, p.heldout_psnr, p.train_psnr, p.samples_per_ray);
  fmt::print("{}; {:.3f} us a sample\n", report.brief(), 1e6 * report.cpu_s / static_cast<double>(report.samples));
  for (const auto& skip : report.skips) fmt::print("skip {}: {}\n", skip.what, skip.why);
  if (a.quick) return {};
  ORBITFUSE_ASSIGN(const TestError error, test_error(field, data, a.images));
  const auto view = std::find_if(data.views.begin(), data.views.end(), [](const auto& v) { return v.measure_only; });
  if (view != data.views.end()) {
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t cpu = std::clock();
    ORBITFUSE_ASSIGN(const nerf::RenderedView out,
                     nerf::render(field, view->camera.scaled_to(640, 640 * view->camera.height / view->camera.width),
                                  view->cam_from_world, {}, {}));
    fmt::print("render {}x{}: {:.2f} s wall, {:.2f} CPU s\n", out.color.cols, out.color.rows,
               std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
               static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC);
  }
  fmt::print("full resolution: {:.2f} dB", error.psnr_db);
  if (data.modality == Modality::thermal) fmt::print(", MAE {:.3f} K", error.mae_k);
  fmt::print("\n");
  if (!a.field.empty()) ORBITFUSE_TRY(field.save(a.field));
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Arguments a;
  CLI::App app("Error against training time of one field");
  app.add_option("--scene", a.scene);
  app.add_option("--preset", a.preset);
  app.add_option("--data", a.data);
  app.add_option("--model", a.model, "COLMAP model with points");
  app.add_option("--images", a.images, "write rendered test views here");
  app.add_option("--field", a.field, "save the field");
  app.add_flag("--depth", a.depth, "dense depth of the training views first");
  app.add_flag("!--no-train", a.train, "stop after the depth");
  app.add_option("--depth-width", a.depth_options.width_px);
  app.add_option("--depth-coarse", a.depth_options.coarse_iterations);
  app.add_option("--depth-fine", a.depth_options.fine_iterations);
  app.add_option("--depth-neighbours", a.depth_options.neighbours);
  app.add_option("--depth-best", a.depth_options.best_neighbours);
  app.add_option("--guide", a.guide, "field whose geometry this one starts from");
  app.add_flag("--quick", a.quick, "no full-resolution evaluation");
  app.add_option("--threads", a.threads);
  app.add_option("--set", a.set, "training option key=value");
  CLI11_PARSE(app, argc, argv);
  if (const auto status = run(a); !status) {
    fmt::print(stderr, "{}\n", status.error().message());
    return 1;
  }
  return 0;
}
