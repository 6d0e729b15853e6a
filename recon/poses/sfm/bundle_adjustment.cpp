// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/bundle_adjustment.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/numeric/angle_units.hpp"
#include "core/numeric/median.hpp"
#include "recon/alignment/projection.hpp"
#include "recon/poses/sfm/bundle_solver.hpp"

namespace orbitfuse {
namespace {

/// What belongs to a view beside its pose.
struct OfView {
  int lens = 0;
  double unit_px = 1;  ///< as in BundleOptions
};

double triangulation_angle_deg(const SparsePoint& point, const std::vector<PosedView>& views) {
  double widest = 0;
  std::vector<Eigen::Vector3d> rays;
  for (const Observation& o : point.track)
    rays.push_back(
        (camera_center(views[static_cast<std::size_t>(o.view)].cam_from_world) - point.position)
            .normalized());
  for (std::size_t i = 0; i < rays.size(); ++i)
    for (std::size_t j = i + 1; j < rays.size(); ++j)
      widest = std::max(widest, std::atan2(rays[i].cross(rays[j]).norm(), rays[i].dot(rays[j])));
  return widest * degrees_per_radian;
}

double reprojection_error_px(const PosedView& view, const Eigen::Vector3d& x,
                             const Eigen::Vector2d& pixel) {
  const double error = (view.camera.project(view.cam_from_world * x) - pixel).norm();
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

Status check_input(const Reconstruction& model, const std::vector<int>& group,
                   const std::vector<LensGroup>& lenses, const BundleOptions& options) {
  const auto bad = [](const std::string& found) {
    return fail(ErrorKind::input, "bundle adjustment", found, "check the model that was read");
  };
  if (group.size() != model.views.size()) return bad("views and lens groups differ in number");
  if (!options.unit_px.empty() && options.unit_px.size() != model.views.size())
    return bad("views and their units differ in number");
  for (const double unit_px : options.unit_px)
    if (!(unit_px > 0 && std::isfinite(unit_px)))
      return bad(fmt::format("a unit of {} pixels", unit_px));
  for (std::size_t v = 0; v < model.views.size(); ++v) {
    if (group[v] < 0 || group[v] >= static_cast<int>(lenses.size()))
      return bad(
          fmt::format("{}: lens group {} of {}", model.views[v].name, group[v], lenses.size()));
    if (!model.views[v].cam_from_world.is_finite())
      return bad(model.views[v].name + ": pose is not finite");
    ORBITFUSE_TRY(model.views[v].camera.validate(model.views[v].name));
  }
  for (const SparsePoint& point : model.points)
    for (const Observation& o : point.track)
      if (o.view < 0 || o.view >= static_cast<int>(model.views.size()))
        return bad(fmt::format("a track names view {} of {}", o.view, model.views.size()));
  return {};
}

/// Drops observations that miss, points without parallax, then views without support.
/// Returns the observations dropped. Names of views that lost their support are appended.
int prune(Reconstruction& model, std::vector<OfView>& of_views, const BundleOptions& options,
          double max_error_px, std::vector<std::string>& dropped) {
  int outliers = 0;
  while (true) {
    std::vector<int> support(model.views.size(), 0);
    std::vector<SparsePoint> kept;
    for (SparsePoint& point : model.points) {
      const auto before = point.track.size();
      std::erase_if(point.track, [&](const Observation& o) {
        const auto v = static_cast<std::size_t>(o.view);
        return !(reprojection_error_px(model.views[v], point.position, o.pixel) <=
                 max_error_px * of_views[v].unit_px);
      });
      outliers += static_cast<int>(before - point.track.size());
      if (point.track.size() < 2 || !point.position.allFinite()) continue;
      if (triangulation_angle_deg(point, model.views) < options.min_triangulation_angle_deg)
        continue;
      for (const Observation& o : point.track) ++support[static_cast<std::size_t>(o.view)];
      kept.push_back(std::move(point));
    }
    model.points = std::move(kept);

    std::vector<int> new_index(model.views.size(), -1);
    std::vector<PosedView> views;
    std::vector<OfView> kept_of;
    for (std::size_t v = 0; v < model.views.size(); ++v) {
      if (support[v] < options.min_observations) {
        dropped.push_back(model.views[v].name);
        continue;
      }
      new_index[v] = static_cast<int>(views.size());
      views.push_back(std::move(model.views[v]));
      kept_of.push_back(of_views[v]);
    }
    const bool stable = views.size() == new_index.size();
    model.views = std::move(views);
    of_views = std::move(kept_of);
    for (SparsePoint& point : model.points) {
      std::erase_if(point.track, [&](const Observation& o) {
        return new_index[static_cast<std::size_t>(o.view)] < 0;
      });
      for (Observation& o : point.track) o.view = new_index[static_cast<std::size_t>(o.view)];
    }
    if (stable || model.views.empty()) return outliers;
  }
}

Status check_support(const Reconstruction& model, const std::vector<std::string>& dropped) {
  if (model.views.size() >= 2 && model.points.size() >= 8) return {};
  return fail(ErrorKind::quality, "bundle adjustment",
              fmt::format("{} views and {} points have parallax ({} views unsupported)",
                          model.views.size(), model.points.size(), dropped.size()),
              "move the camera round the object between views; turning on the spot gives no depth");
}

LensBelief belief_of(const LensGroup& lens, const Camera& camera, const BundleOptions& options) {
  const double focal = lens.focal_px.value_or(camera.fx);
  const double sigma = lens.focal_px ? lens.focal_relative_sigma : 0.5;
  const double offset = options.principal_point_sigma * camera.width;
  const double tangential = options.tangential_sigma;
  LensBelief belief;
  belief.mean = {
      focal, focal * camera.fy / camera.fx, camera.width / 2.0, camera.height / 2.0, 0, 0, 0, 0};
  belief.sigma = {
      focal * std::max(sigma, 1e-9), 1, offset, offset, 0.1, 0.1, tangential, tangential};
  const bool focal_held = lens.focal_px && sigma == 0;
  const bool axis_held = !lens.refine_principal_point, straight = !lens.refine_distortion;
  belief.held = {focal_held, focal_held, axis_held, axis_held,
                 straight,   straight,   straight,  straight};
  return belief;
}

/// Seven degrees of freedom: the first pose, and one coordinate of the farthest centre.
void fix_gauge(BundleSolver& solver) {
  const std::vector<Eigen::Vector3d>& centers = solver.state().center;
  solver.hold_rotation(0);
  for (int axis = 0; axis < 3; ++axis) solver.hold_center(0, axis);
  std::size_t far = 0;
  for (std::size_t v = 1; v < centers.size(); ++v)
    if ((centers[v] - centers[0]).norm() > (centers[far] - centers[0]).norm()) far = v;
  if (far == 0) return;
  int axis = 0;
  (centers[far] - centers[0]).cwiseAbs().maxCoeff(&axis);
  solver.hold_center(far, axis);
}

BundleSolver solver_of(const Reconstruction& model, const std::vector<OfView>& of_views,
                       const std::vector<LensGroup>& lenses, const BundleOptions& options) {
  BundleSolver::State start;
  std::vector<int> lens_of;
  std::vector<LensBelief> beliefs(lenses.size());
  for (LensBelief& unused : beliefs) unused.held.fill(true);
  start.lens.resize(lenses.size());
  for (std::size_t v = model.views.size(); v-- > 0;) {  // of a lens, its first view's
    const auto lens = static_cast<std::size_t>(of_views[v].lens);
    start.lens[lens] = intrinsics_of(model.views[v].camera);
    beliefs[lens] = belief_of(lenses[lens], model.views[v].camera, options);
    if (beliefs[lens].held[0]) std::copy_n(beliefs[lens].mean.begin(), 2, start.lens[lens].begin());
  }
  for (std::size_t v = 0; v < model.views.size(); ++v) {
    lens_of.push_back(of_views[v].lens);
    start.rotation.push_back(model.views[v].cam_from_world.rotation.normalized());
    start.center.push_back(camera_center(model.views[v].cam_from_world));
  }
  std::vector<SeenPoint> seen;
  for (const SparsePoint& point : model.points) {
    for (const Observation& o : point.track)
      seen.push_back({o.view, static_cast<int>(start.point.size()), o.pixel,
                      of_views[static_cast<std::size_t>(o.view)].unit_px});
    start.point.push_back(point.position);
  }
  BundleSolver solver(std::move(start), std::move(lens_of), std::move(beliefs), std::move(seen),
                      options.loss_scale_px);
  fix_gauge(solver);
  return solver;
}

void write_to(const BundleSolver::State& state, const std::vector<OfView>& of_views,
              Reconstruction& model) {
  for (std::size_t v = 0; v < model.views.size(); ++v) {
    PosedView& view = model.views[v];
    const Eigen::Quaterniond& q = state.rotation[v];
    view.cam_from_world = {q, -(q * state.center[v])};
    store(state.lens[static_cast<std::size_t>(of_views[v].lens)], view.camera);
  }
  for (std::size_t i = 0; i < model.points.size(); ++i) model.points[i].position = state.point[i];
}

void measure(const Reconstruction& model, const std::vector<OfView>& of_views,
             BundleReport& report) {
  double sum = 0;
  std::vector<double> angles;
  report.observations = 0;
  for (const SparsePoint& point : model.points) {
    for (const Observation& o : point.track) {
      const auto v = static_cast<std::size_t>(o.view);
      const double e =
          reprojection_error_px(model.views[v], point.position, o.pixel) / of_views[v].unit_px;
      sum += e * e;
      ++report.observations;
    }
    angles.push_back(triangulation_angle_deg(point, model.views));
  }
  report.rms_px = std::sqrt(sum / std::max(report.observations, 1));
  report.median_triangulation_angle_deg = median_in(angles);
}

void store_point_errors(Reconstruction& model) {
  for (SparsePoint& point : model.points) {
    double sum = 0;
    for (const Observation& o : point.track)
      sum += reprojection_error_px(model.views[static_cast<std::size_t>(o.view)], point.position,
                                   o.pixel);
    point.reprojection_error_px = sum / static_cast<double>(point.track.size());
  }
}

}  // namespace

Result<BundleReport> adjust_bundle(Reconstruction& model, const std::vector<int>& group,
                                   const std::vector<LensGroup>& lenses,
                                   const BundleOptions& options) {
  ORBITFUSE_TRY(check_input(model, group, lenses, options));
  Reconstruction work = model;
  std::vector<OfView> of_views;
  for (std::size_t v = 0; v < group.size(); ++v)
    of_views.push_back({group[v], options.unit_px.empty() ? 1 : options.unit_px[v]});
  BundleReport report;

  // The start may be far off (a focal wrong by 30 %), so the first passes keep wide misses: the
  // robust loss deals with them, and only what still misses at the end is an outlier.
  // What one pass leaves to do the next one does.
  struct Pass {
    double max_error_px, cost_tolerance;
  };
  const std::array<Pass, 3> passes = {
      {{1e3, 1e-5}, {8 * options.max_error_px, 1e-5}, {options.max_error_px, 1e-8}}};
  for (const auto& [max_error_px, cost_tolerance] : passes) {
    report.outliers += prune(work, of_views, options, max_error_px, report.dropped_views);
    ORBITFUSE_TRY(check_support(work, report.dropped_views));
    BundleSolver solver = solver_of(work, of_views, lenses, options);
    const TrustRegionEnd end = solver.solve(options.max_iterations, cost_tolerance);
    if (!end.usable)
      return fail(ErrorKind::quality, "bundle adjustment", "residuals of the start are not finite",
                  "the views contradict each other; see the dropped views and match settings");
    report.converged = end.converged;
    write_to(solver.state(), of_views, work);
  }
  report.outliers += prune(work, of_views, options, options.max_error_px, report.dropped_views);
  ORBITFUSE_TRY(check_support(work, report.dropped_views));
  for (const PosedView& view : work.views) ORBITFUSE_TRY(view.camera.validate(view.name));

  const BundleSolver at_the_end = solver_of(work, of_views, lenses, options);
  const std::vector<std::optional<double>> sigmas_px = at_the_end.focal_sigmas();
  for (std::size_t g = 0; g < lenses.size(); ++g) {
    const double sigma = sigmas_px[g] ? *sigmas_px[g] / at_the_end.state().lens[g][0]
                                      : std::numeric_limits<double>::quiet_NaN();
    report.focal_relative_sigma.push_back(sigma);
    const double prior = lenses[g].focal_px ? lenses[g].focal_relative_sigma : 0.5;
    if (std::isfinite(sigma) && sigma > 0.7 * prior)
      report.warnings.push_back(
          fmt::format("the images say little about the focal length of lens {}: it is known to "
                      "{:.1f} %, mostly from its prior",
                      g, 100 * sigma));
  }
  measure(work, of_views, report);
  store_point_errors(work);
  model = std::move(work);
  return report;
}

}  // namespace orbitfuse
