// SPDX-License-Identifier: BSD-3-Clause
// The metric scale that a run's pictures give, against that of its true cameras:
//   scale_error RUN ground_truth.json --mat 2.4 [--tags 9]        the mat on the ground
//   scale_error RUN ground_truth.json --surface TRUE.ply [--count 200] [--least 1.0]
//   scale_error RUN ground_truth.json --known-poses 0.02 [--count 200] [--as-they-are]
// The second: one distance, told by random pairs of pixels of the recorded visible views. Each pair
// lies on the object, in one view, at least `--least` metres apart; its distance is the true
// surface's. The third: poses that came with the session, each true camera off by so many metres
// (one standard deviation an axis), drawn `--count` times; --as-they-are: the run took them instead
// of poses of its own, and is told how far off they are.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <random>

#include "app/export/find_scale.hpp"
#include "app/export/mat_scale.hpp"
#include "bench/exit_status.hpp"
#include "bench/export/true_scene.hpp"
#include "core/geometry/lifted.hpp"
#include "core/geometry/pose_error.hpp"
#include "core/numeric/median.hpp"
#include "recon/surface/surface.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;

struct Options {
  fs::path run, true_mesh, truth;
  MatDesign mat;
  bool by_mat = false, as_they_are = false;
  double noise_m = -1;  ///< of known poses; < 0: they are not asked for
  int count = 200;
  double least_m = 1, most_m = 3;
};

Status score_mat(const Options& o, const view::FinishedRun& run, double true_scale) {
  ORBITFUSE_ASSIGN(const stages::MetricScale scale, exporting::scale_of_mat(run, o.mat, {}));
  fmt::print("{}: scale from the mat, {}: {:+.3f} %, stated +- {:.3f} % (one sigma)\n",
             o.run.filename().string(), scale.how, 100 * (scale.metres_per_unit / true_scale - 1),
             100 * scale.relative_uncertainty);
  return {};
}

Status score_distances(const Options& o, const view::FinishedRun& run, const Similarity3d& fit) {
  ORBITFUSE_ASSIGN(const TriangleMesh mesh, read_mesh(o.true_mesh));
  std::mt19937 random(5);
  std::vector<double> errors;
  int covered = 0, refused = 0;
  for (std::size_t i = 0; static_cast<int>(errors.size()) < o.count && i < run.views.size(); ++i) {
    const view::RecordedView& v = run.views[i];
    if (v.modality != Modality::visible) continue;
    // The run's camera in the true world: its pose is as good as the scale that is asked for.
    const PosedView there{v.view.name, v.view.camera.without_distortion(),
                          rebase(v.view.cam_from_world, fit)};
    const cv::Mat depth = mesh_depth(mesh, there);
    const auto draw = [&]() -> std::optional<std::pair<Eigen::Vector2d, Eigen::Vector3d>> {
      const int x = static_cast<int>(random() % static_cast<unsigned>(depth.cols)),
                y = static_cast<int>(random() % static_cast<unsigned>(depth.rows));
      const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
      const Eigen::Vector3d p = there.cam_from_world.inverse() * lifted(depth, there.camera, x, y);
      if (!p.allFinite() || p.z() < 0.05 || p.head<2>().norm() > o.most_m) return std::nullopt;
      return std::pair(v.view.camera.pixel_of(there.camera.normalized_of(pixel)), p);
    };
    for (int tries = 0, got = 0; tries < 4000 && got < 9; ++tries) {
      const auto a = draw(), b = draw();
      if (!a || !b || (a->second - b->second).norm() < o.least_m) continue;
      const auto scale = exporting::scale_of_distance(
          run, measurement::PixelPlace{v.view.name, a->first},
          measurement::PixelPlace{v.view.name, b->first}, (a->second - b->second).norm(), {});
      if (!scale) {
        ++refused;
        continue;
      }
      ++got;
      const double error = std::abs(scale->metres_per_unit / fit.scale - 1);
      covered += error <= 1.645 * scale->relative_uncertainty;
      errors.push_back(100 * error);
    }
  }
  if (errors.empty())
    return fail(ErrorKind::input, o.run.string(), "no pairs of pixels", "lower --least");
  std::sort(errors.begin(), errors.end());
  fmt::print(
      "{}: scale from one distance of {} m or more, {} pairs: error median {:.3f} %, 90 % "
      "{:.3f} %; 1.645 sigma covers {:.1f} %; {} refused\n",
      o.run.filename().string(), o.least_m, errors.size(), median(errors),
      errors[errors.size() * 9 / 10], 100.0 * covered / static_cast<double>(errors.size()),
      refused);
  return {};
}

/// The true cameras, each off by a draw, as the session's poses; where the run took them, as its
/// own too. Pairs of the given poses with the true ones.
std::vector<PosePair> give_poses(const Options& o, const GroundTruth& truth, std::mt19937& random,
                                 view::FinishedRun& run) {
  std::normal_distribution<double> off(0, o.noise_m);
  std::vector<PosePair> pairs;
  for (FrameRecord& frame : run.session->frames) {
    frame.cam_from_world.reset();
    const auto views = truth.views.find(frame.modality);
    if (views == truth.views.end()) continue;
    for (const TrueView& known : views->second) {
      if (fs::path(known.name).filename() != fs::path(frame.source).filename()) continue;
      frame.cam_from_world = known.cam_from_world;
      if (o.noise_m > 0)
        frame.cam_from_world->translation +=
            known.cam_from_world.rotation * Eigen::Vector3d(off(random), off(random), off(random));
      for (view::RecordedView& v : run.views) {
        if (v.view.name != frame.file) continue;
        pairs.push_back({*frame.cam_from_world, known.cam_from_world, frame.file});
        if (o.as_they_are) v.view.cam_from_world = *frame.cam_from_world;
      }
    }
  }
  return pairs;
}

Status score_known_poses(const Options& o, const GroundTruth& truth, view::FinishedRun& run,
                         double true_scale) {
  if (!run.session) return fail(ErrorKind::input, o.run.string(), "no session", "bring it back");
  std::mt19937 random(11);
  std::vector<double> errors, stated;
  int covered = 0;
  const int draws = o.noise_m > 0 ? o.count : 1;
  for (int i = 0; i < draws; ++i) {
    const std::vector<PosePair> given = give_poses(o, truth, random, run);
    if (o.as_they_are) {
      ORBITFUSE_ASSIGN(const Similarity3d of_given, truth_from_estimate(given));
      true_scale = of_given.scale;
    }
    ORBITFUSE_ASSIGN(const stages::MetricScale scale,
                     exporting::scale_of_known_poses(
                         run, o.as_they_are ? std::optional(o.noise_m) : std::nullopt));
    const double error = std::abs(scale.metres_per_unit / true_scale - 1);
    covered += error <= 1.645 * scale.relative_uncertainty;
    errors.push_back(100 * error);
    stated.push_back(100 * scale.relative_uncertainty);
  }
  std::sort(errors.begin(), errors.end());
  fmt::print(
      "{}: scale from known poses {} m off an axis{}, {} draws: error median {:.4f} %, 90 % {:.4f} "
      "%; stated {:.4f} % (one sigma, median); 1.645 sigma covers {:.1f} %\n",
      o.run.filename().string(), o.noise_m, o.as_they_are ? ", taken as they are" : "",
      errors.size(), median(errors), errors[errors.size() * 9 / 10], median(stated),
      100.0 * covered / static_cast<double>(errors.size()));
  return {};
}

Status run(const Options& o) {
  ORBITFUSE_ASSIGN(const GroundTruth truth, read_ground_truth(o.truth));
  ORBITFUSE_ASSIGN(const Similarity3d fit, truth_from_run(o.run, truth));
  ORBITFUSE_ASSIGN(view::FinishedRun run, view::load_finished_run(o.run, stages::RunConfig(), {}));
  if (o.noise_m >= 0) return score_known_poses(o, truth, run, fit.scale);
  return o.by_mat ? score_mat(o, run, fit.scale) : score_distances(o, run, fit);
}

}  // namespace
}  // namespace orbitfuse

int main(int argc, char** argv) {
  CLI::App app("The metric scale against the true one");
  orbitfuse::Options options;
  app.add_option("run", options.run, "--out folder of a run")->required();
  app.add_option("truth", options.truth, "ground_truth.json")->required();
  auto* mat = app.add_option("--mat", options.mat.size_m, "Side of the mat, m");
  app.add_option("--tags", options.mat.tags_per_side, "Tags a side of it")->capture_default_str();
  app.add_option("--surface", options.true_mesh, "PLY of true_mesh.py, for one distance")
      ->excludes(mat);
  app.add_option("--known-poses", options.noise_m, "Metres that they are off an axis");
  app.add_flag("--as-they-are", options.as_they_are, "The run took them instead of its own");
  app.add_option("--count", options.count, "Pairs, or draws")->capture_default_str();
  app.add_option("--least", options.least_m, "Metres between two places")->capture_default_str();
  app.add_option("--most", options.most_m, "Metres from the middle")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  options.by_mat = mat->count() > 0;
  return orbitfuse::exit_status(orbitfuse::run(options));
}
