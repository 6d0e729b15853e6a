// SPDX-License-Identifier: BSD-3-Clause
// nerf_time_error --scene container --data ../shared/data/orbits [--set key=value ...]
// Trains one field and prints its error against run time; --out also writes it as JSON and SVG.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "bench/nerf/experiment.hpp"
#include "bench/nerf/scenes.hpp"
#include "core/geometry/rotation_vector.hpp"
#include "core/system/clock.hpp"
#include "core/system/cpu.hpp"
#include "core/system/parallel.hpp"
#include "recon/nerf/compute_device.hpp"
#include "recon/nerf/device/on_device.hpp"

namespace {

using namespace orbitfuse;

struct Arguments {
  std::string scene = "fox", preset, data = "../shared/data/orbits", model, images, field, guide,
              out;
  std::vector<std::string> set;
  int threads = 0;
  double exposure = 0, pose_error_deg = 0;
  bool quick = false, depth = false, train = true;
  std::string detail, device = "cpu";
  bool time_kernels = false;
  nerf::DetailOptions detail_options;
  depth::DepthOptions depth_options;
};

void print_curve(const nerf::TrainReport& report) {
  for (const auto& p : report.curve)
    fmt::print(
        "step {:5d}  cpu {:7.1f} s  wall {:7.1f} s  test {:6.2f} dB  train {:6.2f} dB  {:6.1f} "
        "samples/ray\n",
        p.step, p.cpu_s, p.wall_s, p.heldout_psnr, p.train_psnr, p.samples_per_ray);
  fmt::print("{}; {:.3f} us a sample\n", report.brief(),
             1e6 * report.cpu_s / static_cast<double>(report.samples));
  for (const auto& [view, gain] : report.image_gains)
    fmt::print("exposure of {}: {:.3f}\n", view, fmt::join(gain, " "));
  for (const auto& skip : report.skips) fmt::print("skip {}: {}\n", skip.what, skip.why);
}

Status time_render(const nerf::Field& field, const nerf::Dataset& data) {
  const auto view = std::find_if(data.views.begin(), data.views.end(),
                                 [](const auto& v) { return v.measure_only; });
  if (view == data.views.end()) return {};
  const UsageClock clock;
  ORBITFUSE_ASSIGN(
      const nerf::RenderedView out,
      nerf::render(field,
                   view->camera.scaled_to(640, 640 * view->camera.height / view->camera.width),
                   view->cam_from_world, {}, {}));
  fmt::print("render {}x{}: {:.2f} s wall, {:.2f} CPU s\n", out.color.cols, out.color.rows,
             clock.wall_s(), clock.cpu_s());
  return {};
}

/// Training views as a camera on automatic would have stored them: each channel of each view times
/// a gain, clipped.
void vary_exposure(nerf::Dataset& data, double log_sigma) {
  cv::RNG random(7);
  for (nerf::TrainingView& view : data.views) {
    if (view.measure_only) continue;
    const double common = random.gaussian(log_sigma);
    cv::Scalar gain;
    for (int c = 0; c < 3; ++c) gain[c] = std::exp(common + random.gaussian(log_sigma / 4));
    cv::multiply(view.image, gain, view.image);
    view.image = cv::min(view.image, 1.0);
  }
}

/// Training views as poses of that error show them: turned, and moved as far as the turn moves the
/// scene.
void perturb_poses(nerf::Dataset& data, double sigma_deg) {
  cv::RNG random(11);
  const double sigma = sigma_deg * 3.14159265358979 / 180;
  const auto draw = [&] {
    return Eigen::Vector3d(random.gaussian(sigma), random.gaussian(sigma), random.gaussian(sigma));
  };
  for (nerf::TrainingView& view : data.views) {
    if (view.measure_only) continue;
    const Eigen::Vector3d turn = draw(), shift = draw() * view.cam_from_world.translation.norm();
    const Rigid3d moved_from_cam{turned_by(turn), shift};
    view.cam_from_world = moved_from_cam * view.cam_from_world;
  }
}

/// RMS over training views of what a pose is off by: turn in degrees, centre in % of the distance
/// to the world's origin; poses are compared as they are, without a similarity between them.
void print_pose_errors(const std::vector<Rigid3d>& truth, const nerf::Dataset& given,
                       const std::map<std::string, Rigid3d>& refined) {
  const auto print = [&](const char* what, const auto& pose_of) {
    double turn = 0, shift = 0, count = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (given.views[i].measure_only) continue;
      const Rigid3d pose = pose_of(i);
      turn += std::pow(rotation_angle_deg(truth[i].rotation, pose.rotation), 2);
      shift += (camera_center(truth[i]) - camera_center(pose)).squaredNorm() /
               camera_center(truth[i]).squaredNorm();
      ++count;
    }
    fmt::print("poses {}: {:.3f} deg, {:.3f} %\n", what, std::sqrt(turn / count),
               100 * std::sqrt(shift / count));
  };
  print("as given", [&](std::size_t i) { return given.views[i].cam_from_world; });
  print("refined", [&](std::size_t i) { return refined.at(given.views[i].name); });
}

/// Errors of all test views at their full size; with detail of the views that train, if asked.
Status print_errors(const nerf::Field& field, const nerf::Dataset& data, const char* what,
                    nerf::PhotoDetail* detail = nullptr) {
  const UsageClock clock;
  ORBITFUSE_ASSIGN(const bench::TestError error, bench::test_error(field, data, detail));
  const double wall_s = clock.wall_s();
  fmt::print("{}: {:.2f} dB", what, error.psnr_db);
  if (data.modality == Modality::thermal) fmt::print(", MAE {:.3f} K", error.mae_k);
  ORBITFUSE_ASSIGN(const auto metrics, bench::table_metrics(field, data, detail));
  for (const auto& [metric, value] : metrics) fmt::print(", {} {:.4g}", metric, value);
  fmt::print("; {} views rendered in {:.1f} s\n", error.views, wall_s);
  return {};
}

/// The same field on the pictures of another size that scene `a.detail` has, without and with the
/// detail of its views that train.
Status print_detail_errors(const nerf::Field& field, const Arguments& a, double shading_k) {
  ORBITFUSE_ASSIGN(nerf::Dataset full, bench::load_scene(a.detail, a.data, a.model));
  for (nerf::TrainingView& view : full.views)
    if (shading_k != 0 && !view.measure_only)
      view.image = view.image - nerf::shading_image(shading_k, view.image.size());
  ORBITFUSE_ASSIGN(nerf::PhotoDetail detail, bench::detail_of(full, a.detail_options));
  ORBITFUSE_TRY(print_errors(field, full, "field alone"));
  ORBITFUSE_TRY(print_errors(field, full, "with detail", &detail));
  return a.images.empty() ? Status{} : bench::write_pictures(field, full, a.images, &detail);
}

Status use_device(const Arguments& a) {
  if (a.device == "cpu") return {};
  ORBITFUSE_ASSIGN(const std::string name, nerf::use_cuda());
  fmt::print("{}\n", name);
  if (a.time_kernels) nerf::device::current()->time_kernels();
  return {};
}

void print_kernel_times() {
  for (const nerf::device::KernelTime& kernel : nerf::device::current()->kernel_times())
    fmt::print("{:18} {:7} launches {:8.2f} us each {:8.1f} ms\n", kernel.name, kernel.launches,
               1e6 * kernel.seconds / static_cast<double>(kernel.launches), 1e3 * kernel.seconds);
}

Status run(const Arguments& a) {
  if (!a.detail.empty() && (a.pose_error_deg > 0 || a.exposure > 0))
    return fail(ErrorKind::usage, "--detail", "beside --perturb-poses or --vary-exposure",
                "its views are as they were recorded; choose one");
  set_thread_count(a.threads);
  ORBITFUSE_TRY(use_device(a));
  ORBITFUSE_ASSIGN(nerf::Dataset data, bench::load_scene(a.scene, a.data, a.model));
  ORBITFUSE_ASSIGN(nerf::TrainOptions options,
                   nerf::preset(a.preset.empty() ? nerf::default_preset(data.modality) : a.preset));
  options.keep_best = false;  // the measured views are the test split: nothing is chosen on them
  for (const std::string& assignment : a.set) {
    const auto at = assignment.find('=');
    if (at == std::string::npos)
      return fail(ErrorKind::usage, "--set", assignment, "give key=value");
    ORBITFUSE_TRY(options.set(assignment.substr(0, at), assignment.substr(at + 1)));
  }
  fmt::print("{}, {} threads, {}, {}\n", cpu_description(), thread_count(), name(best_isa()),
             a.scene);
  std::vector<Rigid3d> true_poses;
  for (const auto& view : data.views) true_poses.push_back(view.cam_from_world);
  if (a.pose_error_deg > 0) perturb_poses(data, a.pose_error_deg);
  if (a.exposure > 0) vary_exposure(data, a.exposure);
  bench::Run result{options.preset + (a.guide.empty() ? "" : ", without its guide's time"), 0, {}};
  if (a.depth) {
    ORBITFUSE_ASSIGN(result.before_cpu_s, bench::add_depth(data, a.depth_options));
  }
  if (!a.train) return {};
  nerf::Field field, guide;
  if (!a.guide.empty()) {
    ORBITFUSE_ASSIGN(guide, nerf::Field::load(a.guide));
    options.shared_geometry = true;
  }
  ORBITFUSE_ASSIGN(result.report,
                   nerf::train(data, options, {}, field, guide.empty() ? nullptr : &guide));
  print_curve(result.report);
  if (a.time_kernels && nerf::device::current() != nullptr) print_kernel_times();
  if (!result.report.refined_poses.empty())
    print_pose_errors(true_poses, data, result.report.refined_poses);
  if (!a.out.empty()) ORBITFUSE_TRY(bench::write_curves(a.out, a.scene, {result}));
  if (!a.field.empty()) ORBITFUSE_TRY(field.save(a.field));
  if (a.quick) return {};
  ORBITFUSE_TRY(time_render(field, data));
  ORBITFUSE_TRY(print_errors(field, data, "full resolution"));
  if (!a.detail.empty()) return print_detail_errors(field, a, result.report.shading_k);
  return a.images.empty() ? Status{} : bench::write_pictures(field, data, a.images);
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
  app.add_option("--out", a.out, "write the curve as SCENE.json and SCENE.svg here");
  app.add_flag("--depth", a.depth, "dense depth of the training views first");
  app.add_flag("!--no-train", a.train, "stop after the depth");
  app.add_flag("!--no-ground", a.depth_options.ground, "leave open ground without depth");
  app.add_option("--depth-width", a.depth_options.width_px);
  app.add_option("--depth-coarse", a.depth_options.coarse_iterations);
  app.add_option("--depth-fine", a.depth_options.fine_iterations);
  app.add_option("--depth-neighbours", a.depth_options.neighbours);
  app.add_option("--depth-best", a.depth_options.best_neighbours);
  app.add_option("--guide", a.guide, "field whose geometry this one starts from");
  app.add_option("--vary-exposure", a.exposure,
                 "gains of the training views: sigma of their logarithm");
  app.add_option("--perturb-poses", a.pose_error_deg,
                 "error of the training views' poses: sigma of turn and shift, degrees");
  app.add_option(
      "--detail", a.detail,
      "scene whose test views are also compared without and with its other views' detail, "
      "e.g. container-full");
  app.add_option("--detail-sources", a.detail_options.sources);
  app.add_option("--detail-base-width", a.detail_options.base_width_px);
  app.add_option("--detail-angle", a.detail_options.angle_deg);
  app.add_option("--detail-tolerance", a.detail_options.depth_tolerance);
  app.add_option("--detail-unexplained", a.detail_options.unexplained);
  app.add_flag("--quick", a.quick, "no full-resolution evaluation");
  app.add_option("--threads", a.threads);
  app.add_option("--device", a.device)->check(CLI::IsMember({"cpu", "cuda"}));
  app.add_flag("--kernels", a.time_kernels, "time of each kernel of the device, one by one");
  app.add_option("--set", a.set, "training option key=value");
  CLI11_PARSE(app, argc, argv);
  if (const auto status = run(a); !status) {
    fmt::print(stderr, "{}\n", status.error().message());
    return 1;
  }
  return 0;
}
