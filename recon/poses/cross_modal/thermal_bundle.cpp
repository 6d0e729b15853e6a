// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/thermal_bundle.hpp"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/image/undistorted.hpp"
#include "core/numeric/median.hpp"
#include "core/system/parallel.hpp"
#include "recon/alignment/edge_field.hpp"
#include "recon/alignment/patch_matching.hpp"
#include "recon/alignment/patch_residual.hpp"
#include "recon/alignment/pose_correction.hpp"

namespace orbitfuse {
namespace {

/// A view with fewer patches found again is held by edges alone.
constexpr int least_patches = 12;
/// A sighting within this of where the bundle has it confirms the view's pose.
constexpr double confirmed_px = 1;
/// A lens that bends by less than this share of what counts, as the wide rounds see it, is
/// straight.
constexpr double straight_share = 0.5;

/// Ceres cost of two weighted pixels: correction, log_focal, radial, and the point's offset from
/// the surface (world).
class SightingCost final : public ceres::SizedCostFunction<2, 6, 1, 1, 3> {
 public:
  SightingCost(const Eigen::Vector3d& surface, const Rigid3d& cam_from_world, const Camera& camera,
               const ThermalSighting& sighting)
      : rotation_(cam_from_world.rotation.toRotationMatrix()),
        surface_in_cam_(cam_from_world * surface),
        camera_(camera),
        sighting_(sighting) {}

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> offset(parameters[3]);
    const auto seen = corrected_pixel(camera_, parameters[0], *parameters[1], *parameters[2],
                                      surface_in_cam_ + rotation_ * offset);
    if (!seen) return false;
    const Eigen::Matrix2d& weight = sighting_.sqrt_weight;
    Eigen::Map<Eigen::Vector2d> values(residuals);
    values = weight * (seen->pixel - sighting_.pixel);
    if (jacobians == nullptr) return true;
    put_jacobian<6>(weight * seen->by_correction, jacobians[0]);
    put_jacobian<1>(weight * seen->by_log_focal, jacobians[1]);
    put_jacobian<1>(weight * seen->by_radial, jacobians[2]);
    put_jacobian<3>(weight * seen->by_point * rotation_, jacobians[3]);
    return true;
  }

 private:
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d surface_in_cam_;
  Camera camera_;
  ThermalSighting sighting_;
};

/// How far the point has left the surface along the line of sight, in sigmas.
struct SurfaceResidual {
  Eigen::Vector3d sight;
  double sigma;

  template <class T>
  bool operator()(const T* offset, T* residual) const {
    const T along = offset[0] * T(sight.x()) + offset[1] * T(sight.y()) + offset[2] * T(sight.z());
    residual[0] = along / T(sigma);
    return true;
  }
};

/// What one solve is made of, at the options' width.
struct BundleRound {
  ThermalViews views;
  std::vector<ThermalTrack> tracks;
  std::vector<std::vector<PatchMatch>> edges;  ///< of each view, in the visible scene
};

struct BundleSolution {
  std::vector<PoseCorrection> corrections;
  double log_focal = 0;
  double radial = 0;           ///< k1 that straightened images still had
  double radial_reach_px = 0;  ///< by how much a k1 of 1 shifts the outer tenth of the patches
  double median_px = 0;        ///< of the sightings' residuals
  std::vector<int> confirmed;  ///< patches of each view
};

class Bundle {
 public:
  Bundle(const BundleRound& round, const ThermalBundleOptions& options)
      : round_(round), options_(options), offsets_(round.tracks.size(), {0, 0, 0}) {
    solution_.corrections.resize(round.views.images.size(), PoseCorrection{});
    for (std::size_t t = 0; t < round.tracks.size(); ++t) add(round.tracks[t], offsets_[t]);
    for (std::size_t v = 0; v < round.edges.size(); ++v)
      for (const PatchMatch& match : round.edges[v]) add(v, match);
  }

  /// Nothing where no usable answer is found.
  std::optional<BundleSolution> solve(const ValuePrior& log_focal, const ValuePrior& radial,
                                      const std::vector<double>& losses_px) {
    const auto expect = [&](const ValuePrior& prior, double* value) {
      problem_.AddParameterBlock(value, 1);
      if (prior.sigma == 0)
        problem_.SetParameterBlockConstant(value);
      else
        problem_.AddResidualBlock(
            new ceres::AutoDiffCostFunction<ValuePrior, 1, 1>(new ValuePrior(prior)), nullptr,
            value);
    };
    expect(log_focal, &solution_.log_focal);
    expect(radial, &solution_.radial);
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::SPARSE_SCHUR;
    solver.max_num_iterations = options_.max_iterations;
    solver.num_threads = 1;  // more sum in any order
    solver.logging_type = ceres::SILENT;
    for (const double scale_px : losses_px) {
      sighting_loss_.Reset(new ceres::CauchyLoss(scale_px), ceres::TAKE_OWNERSHIP);
      ceres::Solver::Summary summary;
      ceres::Solve(solver, &problem_, &summary);
      if (!summary.IsSolutionUsable()) return std::nullopt;
    }
    judge();
    return solution_;
  }

 private:
  void add(const ThermalTrack& track, std::array<double, 3>& offset) {
    blocks_.emplace_back();
    for (const ThermalSighting& seen : track.sightings)
      blocks_.back().push_back(problem_.AddResidualBlock(
          new SightingCost(track.surface, round_.views.cam_from_world[seen.view],
                           round_.views.camera, seen),
          &sighting_loss_, solution_.corrections[seen.view].data(), &solution_.log_focal,
          &solution_.radial, offset.data()));
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<SurfaceResidual, 1, 3>(
            new SurfaceResidual{track.sight, options_.surface_sigma * track.distance}),
        &surface_loss_, offset.data());
  }

  void add(std::size_t view, const PatchMatch& match) {
    problem_.AddResidualBlock(
        new BentPatchCost(match, round_.views.camera),
        &edge_losses_.emplace_back(new ceres::CauchyLoss(1), options_.edge_weight * match.score,
                                   ceres::TAKE_OWNERSHIP),
        solution_.corrections[view].data(), &solution_.log_focal, &solution_.radial);
  }

  /// A patch confirms the view that it was taken from, and each that shows it, where both have it
  /// within confirmed_px: a view doesn't confirm itself.
  void judge() {
    solution_.confirmed.assign(solution_.corrections.size(), 0);
    std::vector<double> residuals;
    for (std::size_t t = 0; t < blocks_.size(); ++t) {
      std::vector<bool> near;
      for (const ceres::ResidualBlockId block : blocks_[t]) {
        double r[2] = {confirmed_px, confirmed_px};
        problem_.EvaluateResidualBlock(block, false, nullptr, r, nullptr);
        residuals.push_back(std::hypot(r[0], r[1]));
        near.push_back(residuals.back() < confirmed_px);
      }
      if (!near.front()) continue;
      const auto& sightings = round_.tracks[t].sightings;
      for (std::size_t s = 1; s < sightings.size(); ++s)
        solution_.confirmed[sightings[s].view] += near[s] ? 1 : 0;
      solution_.confirmed[sightings.front().view] +=
          std::count(near.begin() + 1, near.end(), true) > 0 ? 1 : 0;
    }
    std::vector<double> radii;
    for (const ThermalTrack& track : round_.tracks)
      radii.push_back(round_.views.camera.normalized_of(track.sightings.front().pixel).norm());
    if (!radii.empty()) {
      constexpr double most = 0.9;
      const auto far =
          radii.begin() + static_cast<std::ptrdiff_t>(most * static_cast<double>(radii.size()));
      std::nth_element(radii.begin(), far, radii.end());
      solution_.radial_reach_px = std::pow(*far, 3) * round_.views.camera.fx;
    }
    solution_.median_px = residuals.empty() ? 0 : median(residuals);
  }

  static ceres::Problem::Options losses_are_ours() {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  const BundleRound& round_;
  const ThermalBundleOptions& options_;
  ceres::LossFunctionWrapper sighting_loss_{new ceres::CauchyLoss(1), ceres::TAKE_OWNERSHIP};
  ceres::CauchyLoss surface_loss_{1};
  std::deque<ceres::ScaledLoss> edge_losses_;
  std::vector<std::array<double, 3>> offsets_;
  BundleSolution solution_;
  ceres::Problem problem_{losses_are_ours()};
  std::vector<std::vector<ceres::ResidualBlockId>> blocks_;  ///< of each track, by its sightings
};

Result<BundleRound> prepared(const OrbitRefinement& refinement, const Fit& alignment,
                             const std::vector<std::size_t>& chosen,
                             const ThermalBundleOptions& options, int reach_px) {
  const Camera& full = alignment.views.front().view.camera;
  const int width = std::min(options.width_px, full.width);
  BundleRound round;
  ThermalViews& views = round.views;
  views.camera =
      full.scaled_to(width, std::max(1, full.height * width / full.width)).without_distortion();
  std::vector<SceneRender> renders;
  for (std::size_t i = 0; i < alignment.views.size(); ++i) {
    ORBITFUSE_TRY(refinement.progress.check("poses.thermal"));
    views.cam_from_world.push_back(alignment.views[i].view.cam_from_world);
    cv::Mat image;
    cv::resize(refinement.orbit.images[i], image, {views.camera.width, views.camera.height}, 0, 0,
               cv::INTER_AREA);
    views.images.push_back(straightened(image, views.camera, alignment.radial));
    ORBITFUSE_ASSIGN(SceneRender render,
                     refinement.renderer(views.camera, views.cam_from_world.back()));
    views.depth.push_back(render.depth);
    renders.push_back(std::move(render));
  }
  ThermalTrackOptions tracks = options.tracks;
  tracks.reach_px = reach_px;
  round.tracks = thermal_tracks(views, chosen, tracks);
  round.edges.resize(renders.size());
  const RenderRound fine = fine_rounds().back();
  parallel_for(static_cast<int>(renders.size()), [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    round.edges[i] = match_patches(
        renders[i], rendered_edges(renders[i]), views.camera,
        orientation_field(views.images[i], 1.0),
        {fine.search_px, fine.patch_search_px, fine.patch_radius_px, fine.patch_spacing_px});
  });
  return round;
}

/// Views with enough sightings to hold them.
std::size_t held_views(const BundleRound& round) {
  std::vector<int> sightings(round.views.images.size(), 0);
  for (const ThermalTrack& track : round.tracks)
    for (const ThermalSighting& seen : track.sightings) ++sightings[seen.view];
  return static_cast<std::size_t>(
      std::count_if(sightings.begin(), sightings.end(), [](int n) { return n >= least_patches; }));
}

void take(const BundleSolution& solution, const std::vector<std::size_t>& chosen, Fit& alignment) {
  const double scale = std::exp(solution.log_focal);
  for (std::size_t i = 0; i < alignment.views.size(); ++i) {
    PosedView& view = alignment.views[i].view;
    view.cam_from_world = rigid_of(solution.corrections[i]) * view.cam_from_world;
    view.camera.fx *= scale, view.camera.fy *= scale;
  }
  for (const std::size_t i : chosen) alignment.views[i].confirmed_patches = solution.confirmed[i];
  alignment.focal_px = alignment.views.front().view.camera.fx;
  // What was straightened before was so in coordinates of the old focal length.
  alignment.radial = alignment.radial * scale * scale + solution.radial;
  alignment.radial_px = std::abs(alignment.radial) * solution.radial_reach_px;
}

/// The most that a chosen view has turned, about itself or about the object.
double most_turned_deg(const OrbitViews& orbit, const std::vector<std::size_t>& chosen,
                       const Fit& before, const Fit& after) {
  double most = 0;
  for (const std::size_t i : chosen)
    most = std::max(most, apart_deg(orbit, before.views[i].view.cam_from_world,
                                    after.views[i].view.cam_from_world));
  return most;
}

/// One round from where the views are: by how much it has turned them at most; nothing where
/// nothing could be solved.
Result<std::optional<double>> solve_round(const OrbitRefinement& refinement,
                                          const FocalGuess& prior,
                                          const std::vector<std::size_t>& chosen,
                                          const BundleStep& step,
                                          const ThermalBundleOptions& options, Fit& bundled) {
  ORBITFUSE_ASSIGN(const BundleRound round,
                   prepared(refinement, bundled, chosen, options, step.reach_px));
  const double focal_px = bundled.views.front().view.camera.fx;
  std::optional<BundleSolution> solution;
  if (2 * held_views(round) >= chosen.size())
    solution = Bundle(round, options)
                   .solve({std::log(prior.focal_px / focal_px), prior.relative_sigma},
                          {-bundled.radial, prior.radial_sigma}, step.losses_px);
  const auto tell = [&](const std::string& words) {
    refinement.progress.report(
        {"poses.thermal", 3, 4, -1,
         fmt::format("{} places seen by several thermal views{}", round.tracks.size(), words)});
  };
  if (!solution) {
    tell(": too few to bundle them");
    return std::nullopt;
  }
  const Fit before = bundled;
  take(*solution, chosen, bundled);
  const double turned_deg = most_turned_deg(refinement.orbit, chosen, before, bundled);
  tell(fmt::format(
      ", {:.2f} px; focal length {:+.2f} %, k1 {:+.3f}, {:.2f} px far out, views turned by up to "
      "{:.2f} deg",
      solution->median_px, 100 * (std::exp(solution->log_focal) - 1), bundled.radial,
      bundled.radial_px, turned_deg));
  return turned_deg;
}

/// A k1 below none folds the image over beyond some radius: a lens whose corners lie there is not
/// described by it.
bool reaches_corners(const Fit& bundled) {
  Camera bent = bundled.views.front().view.camera;
  bent.k1 = bundled.radial;
  for (const double x : {0.0, static_cast<double>(bent.width)})
    for (const double y : {0.0, static_cast<double>(bent.height)})
      if (!bent.normalized_of({x, y}).allFinite()) return false;
  return true;
}

/// Rounds of one kind; false where one could not be solved.
Result<bool> solve_rounds(const OrbitRefinement& refinement, const FocalGuess& prior,
                          const std::vector<std::size_t>& chosen, const BundleStep& step,
                          const ThermalBundleOptions& options, Fit& bundled) {
  double turned_deg = step.settled_deg;
  for (int i = 0; i < step.max_rounds && turned_deg >= step.settled_deg; ++i) {
    ORBITFUSE_ASSIGN(const std::optional<double> turned,
                     solve_round(refinement, prior, chosen, step, options, bundled));
    if (!turned) return false;
    turned_deg = *turned;
  }
  return true;
}

}  // namespace

Status bundle_thermal(const OrbitRefinement& refinement, const FocalGuess& prior,
                      const ThermalBundleOptions& options, Fit& alignment) {
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < alignment.views.size(); ++i)
    if (alignment.views[i].verdict.confidence != Confidence::dropped) chosen.push_back(i);
  if (chosen.empty()) return {};
  Fit bundled = alignment;
  FocalGuess lens = prior;
  const auto solve = [&](const BundleStep& step) {
    return solve_rounds(refinement, lens, chosen, step, options, bundled);
  };
  const auto bends_less = [&](double least_px) {
    return lens.radial_sigma > 0 && bundled.radial_px < least_px;
  };
  const auto straighten = [&] { bundled.radial = bundled.radial_px = lens.radial_sigma = 0; };
  ORBITFUSE_ASSIGN(const bool found, solve(options.wide));
  if (!found) return {};
  if (bends_less(straight_share * options.least_radial_px)) straighten();
  ORBITFUSE_ASSIGN(const bool refined, solve(options.fine));
  if (!refined) return {};
  if (bends_less(options.least_radial_px) || !reaches_corners(bundled)) {
    straighten();
    ORBITFUSE_ASSIGN(const bool again, solve(options.fine));
    if (!again) return {};
  }
  alignment = std::move(bundled);
  return {};
}

}  // namespace orbitfuse
