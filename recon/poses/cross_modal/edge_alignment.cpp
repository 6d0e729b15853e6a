// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/edge_alignment.hpp"

#include "recon/alignment/edge_field.hpp"

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/numeric/median.hpp"
#include "core/system/parallel.hpp"
#include "recon/alignment/projection.hpp"

namespace orbitfuse {
namespace {

/// A point of a line and the image edge it should fall on; only the distance across counts.
struct EdgeMatch {
  Eigen::Vector3d point;
  Eigen::Vector2d target, normal;
  double weight = 1;
};

struct EdgeDistance {
  EdgeMatch match;
  Intrinsics lens;

  template <class T>
  bool operator()(const T* rotation, const T* center, const T* focal, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(rotation);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> c(center);
    const Eigen::Matrix<T, 3, 1> x = q * (match.point.cast<T>() - c);
    T values[8];
    for (int i = 0; i < 8; ++i) values[i] = T(lens[static_cast<std::size_t>(i)]);
    values[0] = focal[0] * T(lens[0]);
    values[1] = focal[0] * T(lens[1]);
    const Eigen::Matrix<T, 2, 1> p = project(x, values);
    residual[0] = T(match.weight) * (T(match.normal.x()) * (p.x() - T(match.target.x())) +
                                     T(match.normal.y()) * (p.y() - T(match.target.y())));
    return true;
  }
};

struct FocalPrior {
  double sigma;
  double mean;
  template <class T>
  bool operator()(const T* focal, T* residual) const {
    residual[0] = (focal[0] - T(mean)) / T(sigma);
    return true;
  }
};

/// Strongest agreeing edge across a sample, a nearer one preferred; parabola for the sub-pixel.
bool find_edge(const cv::Mat& field, const LineModel::Sample& sample, double reach_px,
               double min_agreement, EdgeMatch& match) {
  constexpr double step = 0.75;
  const int count = std::max(2, static_cast<int>(std::ceil(reach_px / step)));
  thread_local std::vector<double> response;
  response.assign(static_cast<std::size_t>(2 * count + 1), 0.0);
  for (int k = -count; k <= count; ++k) {
    const Eigen::Vector2d p = sample.pixel + k * step * sample.normal;
    response[static_cast<std::size_t>(k + count)] =
        agreement(field_at(field, p.x(), p.y()), sample.normal);
  }
  double best = 0, best_offset = 0, best_raw = 0;
  for (int k = -count + 1; k < count; ++k) {
    const double here = response[static_cast<std::size_t>(k + count)];
    const double before = response[static_cast<std::size_t>(k + count - 1)];
    const double after = response[static_cast<std::size_t>(k + count + 1)];
    if (here < min_agreement || here < before || here < after) continue;
    const double value = here * (1.0 - 0.6 * std::abs(k) / count);
    if (value <= best) continue;
    best = value, best_raw = here;
    const double bend = before - 2 * here + after;
    best_offset = step * (k + (bend < -1e-9 ? 0.5 * (before - after) / bend : 0.0));
  }
  if (best <= 0) return false;
  match.target = sample.pixel + best_offset * sample.normal;
  match.normal = sample.normal;
  match.weight = std::sqrt(best_raw);
  return true;
}

std::vector<EdgeMatch> matches_of(const LineModel& lines, const AlignmentView& view,
                                  double reach_px, const AlignmentOptions& options, int* total) {
  std::vector<EdgeMatch> matches;
  const auto samples = lines.samples(view.view.camera, view.view.cam_from_world, options.step_px);
  if (total != nullptr) *total = static_cast<int>(samples.size());
  for (const LineModel::Sample& sample : samples) {
    EdgeMatch match;
    if (!find_edge(view.field, sample, reach_px, options.min_agreement, match)) continue;
    const EdgeLine& line = lines.line(sample.line);
    match.point = line.a + sample.along * (line.b - line.a);
    matches.push_back(match);
  }
  return matches;
}

}  // namespace

double alignment_score(const LineModel& lines, const Camera& camera, const Rigid3d& cam_from_world,
                       const cv::Mat& field) {
  const double field_step = static_cast<double>(camera.width) / field.cols;
  double sum = 0;
  int count = 0;
  for (const LineModel::Sample& s : lines.samples(camera, cam_from_world, 2.0 * field_step)) {
    sum += agreement(field_at(field, s.pixel.x() / field_step, s.pixel.y() / field_step), s.normal);
    ++count;
  }
  return count > 0 ? sum / count : 0.0;
}

double OrbitPrior::penalty(const OrbitPose& at) const {
  if (weight == 0) return 0;
  const double azimuth = std::remainder(at.azimuth_deg - pose.azimuth_deg, 360) / azimuth_sigma_deg;
  const double elevation = (at.elevation_deg - pose.elevation_deg) / elevation_sigma_deg;
  const double radius = std::log(at.radius / pose.radius) / radius_relative_sigma;
  return weight * (azimuth * azimuth + elevation * elevation + radius * radius);
}

OrbitPose pattern_search(const LineModel& lines, const Camera& camera, const cv::Mat& field,
                         OrbitPose start, const PatternSteps& steps, const OrbitPrior& prior) {
  const auto score = [&](const OrbitPose& pose) {
    return alignment_score(lines, camera, cam_from_world_of(pose, camera), field) -
           prior.penalty(pose);
  };
  double best = score(start);
  double scale = 1.0;
  for (int level = 0; level <= steps.halvings; ++level, scale *= 0.5) {
    for (int pass = 0; pass < 6; ++pass) {
      const double before = best;
      for (int coordinate = 0; coordinate < 6; ++coordinate)
        for (const double sign : {1.0, -1.0}) {
          OrbitPose trial = start;
          const double d = sign * scale;
          if (coordinate == 0) trial.shift_x_px += d * steps.shift_px;
          if (coordinate == 1) trial.shift_y_px += d * steps.shift_px;
          if (coordinate == 2) trial.radius *= 1.0 + d * steps.radius;
          if (coordinate == 3) trial.azimuth_deg += d * steps.angle_deg;
          if (coordinate == 4)
            trial.elevation_deg =
                std::clamp(trial.elevation_deg + d * steps.angle_deg, -85.0, 85.0);
          if (coordinate == 5) trial.roll_deg += d * steps.roll_deg;
          const double value = score(trial);
          if (value > best) {
            best = value;
            start = trial;
            break;
          }
        }
      if (best <= before) break;
    }
  }
  return start;
}

Result<AlignmentReport> align_edges(const LineModel& lines, std::vector<AlignmentView>& views,
                                    const AlignmentOptions& options, const Progress& progress) {
  AlignmentReport report;
  const std::size_t count = views.size();
  std::vector<Eigen::Quaterniond> rotation(count);
  std::vector<Eigen::Vector3d> center(count);
  std::vector<Intrinsics> lens(count);
  for (std::size_t i = 0; i < count; ++i) {
    rotation[i] = views[i].view.cam_from_world.rotation.normalized();
    center[i] = camera_center(views[i].view.cam_from_world);
    lens[i] = intrinsics_of(views[i].view.camera);
  }
  double focal = 1.0;  // relative to the views' own
  const double prior = options.focal_px > 0 ? options.focal_px / lens[0][0] : 1.0;

  const auto store_back = [&] {
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Quaterniond q = rotation[i].normalized();
      views[i].view.cam_from_world = {q, -(q * center[i])};
      views[i].view.camera.fx = lens[i][0] * focal;
      views[i].view.camera.fy = lens[i][1] * focal;
    }
  };

  for (int round = 0; round < options.rounds; ++round) {
    ORBITFUSE_TRY(progress.check("poses.thermal"));
    const double t = options.rounds > 1 ? static_cast<double>(round) / (options.rounds - 1) : 1.0;
    const double reach =
        options.first_reach_px * std::pow(options.last_reach_px / options.first_reach_px, t);
    std::vector<std::vector<EdgeMatch>> matches(count);
    parallel_for(static_cast<int>(count), [&](int i) {
      matches[static_cast<std::size_t>(i)] =
          matches_of(lines, views[static_cast<std::size_t>(i)], reach, options, nullptr);
    });

    ceres::Problem problem;
    problem.AddParameterBlock(&focal, 1);
    bool any = false;
    for (std::size_t i = 0; i < count; ++i) {
      if (matches[i].size() < 20) continue;
      any = true;
      for (const EdgeMatch& match : matches[i])
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<EdgeDistance, 1, 4, 3, 1>(
                                     new EdgeDistance{match, lens[i]}),
                                 new ceres::CauchyLoss(std::max(0.7, 0.3 * reach)),
                                 rotation[i].coeffs().data(), center[i].data(), &focal);
      problem.SetManifold(rotation[i].coeffs().data(), new ceres::EigenQuaternionManifold);
    }
    if (!any)
      return fail(ErrorKind::quality, "poses.thermal",
                  "no thermal view has edges where the visible scene's lines fall",
                  "check that both modalities show the same object, and the focal length");
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<FocalPrior, 1, 1>(new FocalPrior{
                                 std::max(options.focal_relative_sigma, 1e-9), prior}),
                             nullptr, &focal);
    if (options.focal_relative_sigma == 0) problem.SetParameterBlockConstant(&focal);
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    solver.num_threads = 1;  // more sum in any order
    solver.max_num_iterations = 12;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    if (!summary.IsSolutionUsable() || !(focal > 0))
      return fail(ErrorKind::quality, "poses.thermal", summary.message,
                  "the thermal edges contradict the visible scene");
    store_back();

    if (round + 1 < options.rounds) continue;
    report.focal_relative_sigma = 0;
    if (options.focal_relative_sigma > 0) {
      ceres::Covariance covariance{ceres::Covariance::Options()};
      const std::vector<std::pair<const double*, const double*>> blocks = {{&focal, &focal}};
      double variance = 0;
      if (covariance.Compute(blocks, &problem) &&
          covariance.GetCovarianceBlock(&focal, &focal, &variance))
        report.focal_relative_sigma = std::sqrt(variance) / focal;
    }
  }
  report.focal_px = views[0].view.camera.fx;
  for (AlignmentView& view : views) {
    int total = 0;
    const auto matches = matches_of(lines, view, options.last_reach_px, options, &total);
    std::vector<double> distances;
    for (const EdgeMatch& m : matches)
      distances.push_back(std::abs(
          m.normal.dot(view.view.camera.project(view.view.cam_from_world * m.point) - m.target)));
    report.samples.push_back(total);
    report.matched_share.push_back(static_cast<double>(matches.size()) / std::max(total, 1));
    report.residual_px.push_back(median(std::move(distances)));
  }
  return report;
}

}  // namespace orbitfuse
