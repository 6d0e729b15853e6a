// SPDX-License-Identifier: BSD-3-Clause
// Spots of a finished run against exact truth: random pixels of the object in the noise-free test
// views, the run's own poses.
//   measurement_spots RUN TRUTH [--count 200] [--csv FILE]
// RUN: --out folder of `orbitfuse run`; TRUTH: the scene's ground_truth.json.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "app/stages/artifacts.hpp"
#include "app/stages/measurement_scene.hpp"
#include "bench/exit_status.hpp"
#include "bench/export/true_scene.hpp"
#include "core/formats/ground_truth.hpp"
#include "core/image/image_io.hpp"
#include "core/numeric/median.hpp"
#include "core/system/clock.hpp"
#include "recon/measurement/frame_readings.hpp"
#include "recon/measurement/region.hpp"
#include "recon/measurement/surface_samples.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using namespace measurement;

struct Options {
  fs::path run, truth, csv;
  int count = 200;
  unsigned seed = 7;
  MeasurementOptions measurement;
};

struct Spot {
  std::size_t view;
  Eigen::Vector2d pixel;
  double truth_k;
};

struct Scene {
  ThermalScene scene;
  std::vector<PosedView> views;  ///< test cameras in the run's world
  std::vector<cv::Mat> truth_k;
};

Result<Scene> load(const Options& options) {
  ORBITFUSE_ASSIGN(const nlohmann::json run, stages::read_json(options.run / "run.json"));
  ORBITFUSE_ASSIGN(const Session session, open_session(run.at("session").get<std::string>()));
  ORBITFUSE_ASSIGN(const GroundTruth truth, read_ground_truth(options.truth));
  ORBITFUSE_ASSIGN(const Similarity3d fit, truth_from_run(options.run, truth));
  ORBITFUSE_ASSIGN(ThermalScene scene,
                   stages::load_measurement_scene(options.run, session, options.measurement));
  Scene result{std::move(scene), {}, {}};
  for (const TrueTestView& test : truth.test) {
    result.views.push_back({test.thermal.filename().string(), test.camera.without_distortion(),
                            rebase(test.cam_from_world, fit.inverse())});
    ORBITFUSE_ASSIGN(cv::Mat kelvin, read_thermal_k(test.thermal));
    result.truth_k.push_back(std::move(kelvin));
  }
  return result;
}

/// Random pixels whose surface, as the field has it, is the object's.
Result<std::vector<Spot>> draw(const Scene& scene, const Options& options) {
  std::mt19937 random(options.seed);
  std::vector<Spot> spots;
  const auto& middle = scene.scene.middle();
  for (int tries = 0; static_cast<int>(spots.size()) < options.count && tries < 100 * options.count;
       ++tries) {
    Spot spot;
    spot.view = random() % scene.views.size();
    const Camera& camera = scene.views[spot.view].camera;
    const auto x = static_cast<int>(random() % static_cast<unsigned>(camera.width)),
               y = static_cast<int>(random() % static_cast<unsigned>(camera.height));
    spot.pixel = {x + 0.5, y + 0.5};
    spot.truth_k = static_cast<double>(scene.truth_k[spot.view].at<float>(y, x));
    const auto surface = scene.scene.surface_at(scene.views[spot.view], spot.pixel, {});
    if (!surface || !std::isfinite(spot.truth_k) || spot.truth_k < 273.15) continue;  // sky
    if (middle && (surface->position - middle->center).norm() > object_radius(*middle)) continue;
    spots.push_back(spot);
  }
  return spots;
}

struct Tally {
  std::vector<double> error, field_error, against, stated;
  int covered = 0, unseen = 0;
};

void report(const Options& options, Tally t, double first_s, double spot_s) {
  const auto n = static_cast<double>(t.error.size());
  fmt::print(
      "{}: {} spots, {} seen by no frame; error median {:.3f} K, 90 % {:.3f} K; stated covers "
      "{:.1f} %, median {:.3f} K; field's error {:.3f} K; field against frames {:.3f} K; first "
      "spot "
      "{:.2f} CPU s, others {:.4f} CPU s\n",
      options.run.filename().string(), t.error.size(), t.unseen, median(t.error),
      quantile(t.error, 0.9), 100 * t.covered / n, median(t.stated), median(t.field_error),
      median(t.against), first_s, spot_s);
}

Status run(const Options& options) {
  ORBITFUSE_ASSIGN(const Scene scene, load(options));
  ORBITFUSE_ASSIGN(std::vector<Spot> spots, draw(scene, options));
  Tally tally;
  std::ofstream csv;
  if (!options.csv.empty()) {
    csv.open(options.csv);
    csv << "view,u,v,truth_k,temperature_k,field_k,uncertainty_k,spread_k,frames,angle_deg,"
           "variation_k,readings\n";
  }
  double first_s = 0;
  UsageClock clock;
  for (Spot& spot : spots) {
    const UsageClock one;
    ORBITFUSE_ASSIGN(const SurfacePoint surface,
                     scene.scene.surface_at(scene.views[spot.view], spot.pixel, {}));
    ORBITFUSE_ASSIGN(const TemperatureReading reading, read_spot(scene.scene, surface, {}, {}));
    if (&spot == &spots.front()) {
      first_s = one.cpu_s();
      clock = UsageClock();
    }
    if (!reading.seen()) {
      ++tally.unseen;
      continue;
    }
    const double error = std::abs(reading.temperature_k - spot.truth_k);
    tally.error.push_back(error);
    tally.covered += error <= reading.uncertainty_k;
    tally.stated.push_back(reading.uncertainty_k);
    tally.field_error.push_back(std::abs(reading.field_k - spot.truth_k));
    tally.against.push_back(std::abs(reading.field_k - reading.temperature_k));
    if (!csv.is_open()) continue;
    ORBITFUSE_ASSIGN(const PointReadings frames, read_frames(scene.scene, surface, {}, {}));
    std::string list;
    for (const FrameReading& r : frames.frames)
      list += fmt::format("{:.4f}:{:.2f}:{:.4f}:{:.5f}:{};", r.temperature_k, r.angle_deg,
                          r.gradient_k_per_px, r.weight, r.frame);
    csv << fmt::format("{},{},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{},{:.2f},{:.4f},{}\n",
                       spot.view, spot.pixel.x(), spot.pixel.y(), spot.truth_k,
                       reading.temperature_k, reading.field_k, reading.uncertainty_k,
                       reading.spread_k, reading.frames.size(), reading.angle_deg,
                       surface.variation_k, list);
  }
  report(options, tally, first_s,
         clock.cpu_s() / std::max<double>(1, static_cast<double>(spots.size()) - 1));
  return {};
}

}  // namespace
}  // namespace orbitfuse

int main(int argc, char** argv) {
  CLI::App app("Spots of a finished run against exact truth");
  orbitfuse::Options options;
  app.add_option("run", options.run, "--out folder of a run")->required();
  app.add_option("truth", options.truth, "ground_truth.json")->required();
  app.add_option("--count", options.count, "Random pixels of the object")->capture_default_str();
  app.add_option("--seed", options.seed, "Of the random pixels")->capture_default_str();
  app.add_option("--csv", options.csv, "Every spot with every frame's reading");
  app.add_option("--depth-width", options.measurement.depth_width_px, "Of the depth maps")
      ->capture_default_str();
  app.add_option("--depth-tolerance", options.measurement.depth_tolerance, "Share of the distance")
      ->capture_default_str();
  app.add_option("--max-angle", options.measurement.max_angle_deg, "To the normal, degrees")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return orbitfuse::exit_status(orbitfuse::run(options));
}
