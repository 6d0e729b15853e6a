// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/bundle_adjustment.hpp"

#include <ceres/ceres.h>

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

namespace orbitfuse {
namespace {

/// The unknowns, as Ceres wants them: plain arrays that stay put.
struct Parameters {
  std::vector<Eigen::Quaterniond> rotation;
  std::vector<Eigen::Vector3d> center;
  std::vector<Intrinsics> lens;
  std::vector<Eigen::Vector3d> point;
};

struct Reprojection {
  Eigen::Vector2d pixel;

  template <class T>
  bool operator()(const T* rotation, const T* center, const T* lens, const T* point,
                  T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(rotation);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> c(center), x(point);
    const Eigen::Matrix<T, 3, 1> x_in_cam = q * (x - c);
    if (x_in_cam.z() <= T(1e-9)) {  // behind: a large, finite push back
      residual[0] = residual[1] = T(1e3);
      return true;
    }
    const Eigen::Matrix<T, 2, 1> p = project(x_in_cam, lens);
    residual[0] = p.x() - T(pixel.x());
    residual[1] = p.y() - T(pixel.y());
    return true;
  }
};

/// Square pixels, centred axis, little distortion, and the focal prior, each in its own sigma.
struct LensPriorResidual {
  Intrinsics mean;
  Intrinsics sigma;
  double aspect_sigma = 0.002;

  template <class T>
  bool operator()(const T* lens, T* residual) const {
    for (int i = 0; i < 8; ++i)
      residual[i] =
          (lens[i] - T(mean[static_cast<std::size_t>(i)])) / T(sigma[static_cast<std::size_t>(i)]);
    residual[1] = (lens[1] / lens[0] - T(mean[1] / mean[0])) / T(aspect_sigma);
    return true;
  }
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
                   const std::vector<LensGroup>& lenses) {
  const auto bad = [](const std::string& found) {
    return fail(ErrorKind::input, "bundle adjustment", found, "check the model that was read");
  };
  if (group.size() != model.views.size()) return bad("views and lens groups differ in number");
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
int prune(Reconstruction& model, std::vector<int>& group, const BundleOptions& options,
          double max_error_px, std::vector<std::string>& dropped) {
  int outliers = 0;
  while (true) {
    std::vector<int> support(model.views.size(), 0);
    std::vector<SparsePoint> kept;
    for (SparsePoint& point : model.points) {
      const auto before = point.track.size();
      std::erase_if(point.track, [&](const Observation& o) {
        return !(reprojection_error_px(model.views[static_cast<std::size_t>(o.view)],
                                       point.position, o.pixel) <= max_error_px);
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
    std::vector<int> groups;
    for (std::size_t v = 0; v < model.views.size(); ++v) {
      if (support[v] < options.min_observations) {
        dropped.push_back(model.views[v].name);
        continue;
      }
      new_index[v] = static_cast<int>(views.size());
      views.push_back(std::move(model.views[v]));
      groups.push_back(group[v]);
    }
    const bool stable = views.size() == new_index.size();
    model.views = std::move(views);
    group = std::move(groups);
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

class Problem {
 public:
  Problem(const Reconstruction& model, const std::vector<int>& group,
          const std::vector<LensGroup>& lenses, const BundleOptions& options,
          std::size_t max_points)
      : model_(model), group_(group), lenses_(lenses), options_(options) {
    for (const PosedView& view : model.views) {
      parameters_.rotation.push_back(view.cam_from_world.rotation.normalized());
      parameters_.center.push_back(camera_center(view.cam_from_world));
    }
    for (const SparsePoint& point : model.points) parameters_.point.push_back(point.position);
    add_lenses();
    add_observations(max_points);
    fix_gauge();
  }

  ceres::Solver::Summary solve(double function_tolerance) {
    ceres::Solver::Options solver;
    solver.linear_solver_type =
        model_.views.size() > 200 ? ceres::SPARSE_SCHUR : ceres::DENSE_SCHUR;
    solver.num_threads = 1;  // more sum in any order; these problems are small
    solver.max_num_iterations = options_.max_iterations;
    solver.function_tolerance = function_tolerance;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem_, &summary);
    return summary;
  }

  void write_to(Reconstruction& model) const {
    for (std::size_t v = 0; v < model.views.size(); ++v) {
      PosedView& view = model.views[v];
      const Eigen::Quaterniond q = parameters_.rotation[v].normalized();
      view.cam_from_world = {q, -(q * parameters_.center[v])};
      store(parameters_.lens[static_cast<std::size_t>(group_[v])], view.camera);
    }
    for (std::size_t i = 0; i < model.points.size(); ++i)
      model.points[i].position = parameters_.point[i];
  }

  double focal_relative_sigma(std::size_t g) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    double* lens = parameters_.lens[g].data();
    if (!used_[g] || problem_.IsParameterBlockConstant(lens)) return none;
    ceres::Covariance::Options settings;
    settings.num_threads = 1;
    ceres::Covariance covariance(settings);
    const std::vector<std::pair<const double*, const double*>> blocks = {{lens, lens}};
    if (!covariance.Compute(blocks, &problem_)) return none;
    std::array<double, 64> block{};
    covariance.GetCovarianceBlock(lens, lens, block.data());
    return std::sqrt(block[0]) / lens[0];
  }

 private:
  void add_lenses() {
    used_.assign(lenses_.size(), false);
    parameters_.lens.resize(lenses_.size());
    for (std::size_t v = 0; v < model_.views.size(); ++v) {
      const auto g = static_cast<std::size_t>(group_[v]);
      if (used_[g]) continue;
      used_[g] = true;
      const Camera& camera = model_.views[v].camera;
      parameters_.lens[g] = intrinsics_of(camera);
      add_prior(g, camera);
    }
  }

  void add_prior(std::size_t g, const Camera& camera) {
    const LensGroup& lens = lenses_[g];
    LensPriorResidual prior;
    const double focal = lens.focal_px.value_or(camera.fx);
    const double sigma = lens.focal_px ? lens.focal_relative_sigma : 0.5;
    const double offset = options_.principal_point_sigma * camera.width;
    prior.mean = {
        focal, focal * camera.fy / camera.fx, camera.width / 2.0, camera.height / 2.0, 0, 0, 0, 0};
    const double tangential = options_.tangential_sigma;
    prior.sigma = {
        focal * std::max(sigma, 1e-9), 1, offset, offset, 0.1, 0.1, tangential, tangential};
    double* values = parameters_.lens[g].data();
    std::vector<int> held;
    if (lens.focal_px && sigma == 0) held.insert(held.end(), {0, 1});
    if (!lens.refine_principal_point) held.insert(held.end(), {2, 3});
    if (!lens.refine_distortion) held.insert(held.end(), {4, 5, 6, 7});
    problem_.AddParameterBlock(values, 8);
    if (held.size() == 8) {
      problem_.SetParameterBlockConstant(values);
      return;
    }
    if (!held.empty()) problem_.SetManifold(values, new ceres::SubsetManifold(8, held));
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<LensPriorResidual, 8, 8>(new LensPriorResidual(prior)),
        nullptr, values);
  }

  void add_observations(std::size_t max_points) {
    std::vector<std::size_t> order(model_.points.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return model_.points[a].track.size() > model_.points[b].track.size();
    });
    order.resize(std::min(order.size(), max_points));
    for (const std::size_t i : order)
      for (const Observation& o : model_.points[i].track) {
        const auto v = static_cast<std::size_t>(o.view);
        problem_.AddResidualBlock(
            new ceres::AutoDiffCostFunction<Reprojection, 2, 4, 3, 8, 3>(new Reprojection{o.pixel}),
            new ceres::CauchyLoss(options_.loss_scale_px), parameters_.rotation[v].coeffs().data(),
            parameters_.center[v].data(),
            parameters_.lens[static_cast<std::size_t>(group_[v])].data(),
            parameters_.point[i].data());
      }
    for (std::size_t v = 0; v < model_.views.size(); ++v)
      if (problem_.HasParameterBlock(parameters_.rotation[v].coeffs().data()))
        problem_.SetManifold(parameters_.rotation[v].coeffs().data(),
                             new ceres::EigenQuaternionManifold);
  }

  /// Seven degrees of freedom: the first pose, and one coordinate of the farthest centre.
  void fix_gauge() {
    const auto& centers = parameters_.center;
    const auto used = [&](std::size_t v) { return problem_.HasParameterBlock(centers[v].data()); };
    std::size_t first = 0;
    while (first < centers.size() && !used(first)) ++first;
    if (first == centers.size()) return;
    problem_.SetParameterBlockConstant(parameters_.rotation[first].coeffs().data());
    problem_.SetParameterBlockConstant(parameters_.center[first].data());
    std::size_t far = first;
    for (std::size_t v = first + 1; v < centers.size(); ++v)
      if (used(v) && (centers[v] - centers[first]).norm() > (centers[far] - centers[first]).norm())
        far = v;
    if (far == first) return;
    int axis = 0;
    (centers[far] - centers[first]).cwiseAbs().maxCoeff(&axis);
    problem_.SetManifold(parameters_.center[far].data(), new ceres::SubsetManifold(3, {axis}));
  }

  const Reconstruction& model_;
  const std::vector<int>& group_;
  const std::vector<LensGroup>& lenses_;
  const BundleOptions& options_;
  Parameters parameters_;
  std::vector<bool> used_;
  ceres::Problem problem_;
};

void measure(const Reconstruction& model, BundleReport& report) {
  double sum = 0;
  std::vector<double> angles;
  report.observations = 0;
  for (const SparsePoint& point : model.points) {
    for (const Observation& o : point.track) {
      const double e = reprojection_error_px(model.views[static_cast<std::size_t>(o.view)],
                                             point.position, o.pixel);
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
  ORBITFUSE_TRY(check_input(model, group, lenses));
  Reconstruction work = model;
  std::vector<int> groups = group;
  BundleReport report;

  // The start may be far off (a focal wrong by 30 %), so the first passes keep wide misses: the
  // robust loss deals with them, and only what still misses at the end is an outlier.
  // What one pass leaves to do the next one does.
  struct Pass {
    double max_error_px, function_tolerance;
  };
  const std::array<Pass, 3> passes = {
      {{1e3, 1e-5}, {8 * options.max_error_px, 1e-5}, {options.max_error_px, 1e-8}}};
  for (const auto& [max_error_px, function_tolerance] : passes) {
    report.outliers += prune(work, groups, options, max_error_px, report.dropped_views);
    ORBITFUSE_TRY(check_support(work, report.dropped_views));
    Problem problem(work, groups, lenses, options, work.points.size());
    const ceres::Solver::Summary summary = problem.solve(function_tolerance);
    if (!summary.IsSolutionUsable())
      return fail(ErrorKind::quality, "bundle adjustment", summary.message,
                  "the views contradict each other; see the dropped views and match settings");
    report.converged = summary.termination_type == ceres::CONVERGENCE;
    problem.write_to(work);
  }
  report.outliers += prune(work, groups, options, options.max_error_px, report.dropped_views);
  ORBITFUSE_TRY(check_support(work, report.dropped_views));
  for (const PosedView& view : work.views) ORBITFUSE_TRY(view.camera.validate(view.name));

  // The longest tracks decide the focal; all of them would make the covariance the dearest step.
  Problem of_focal(work, groups, lenses, options, 1500);
  for (std::size_t g = 0; g < lenses.size(); ++g) {
    report.focal_relative_sigma.push_back(of_focal.focal_relative_sigma(g));
    const double sigma = report.focal_relative_sigma.back();
    const double prior = lenses[g].focal_px ? lenses[g].focal_relative_sigma : 0.5;
    if (std::isfinite(sigma) && sigma > 0.7 * prior)
      report.warnings.push_back(
          fmt::format("the images say little about the focal length of lens {}: it is known to "
                      "{:.1f} %, mostly from its prior",
                      g, 100 * sigma));
  }
  measure(work, report);
  store_point_errors(work);
  model = std::move(work);
  return report;
}

}  // namespace orbitfuse
