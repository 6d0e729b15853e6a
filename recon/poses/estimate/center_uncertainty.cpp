// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/center_uncertainty.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/rotation_vector.hpp"
#include "core/geometry/scene_ball.hpp"
#include "recon/poses/index.hpp"

namespace orbitfuse {
namespace {

using Pose6x3 = Eigen::Matrix<double, 6, 3>;

/// What one observation says of its view's pose (rotation, then translation, before the camera's
/// own) and of its point, in pixels.
struct Linearized {
  int view = 0;
  Eigen::Matrix<double, 2, 6> by_pose;
  Eigen::Matrix<double, 2, 3> by_point;
};

struct Residuals {
  double squares = 0;
  int number = 0;  ///< coordinates
};

class NormalMatrix {
 public:
  explicit NormalMatrix(const Reconstruction& model)
      : model_(model),
        radius_(rms_radius(centers_of(model))),
        rotations_(rotations_of(model)),
        matrix_(Eigen::MatrixXd::Zero(parameters(), parameters())),
        held_(model.views.size(), 0),
        residuals_(model.views.size()) {
    for (const SparsePoint& point : model.points) add(point);
  }

  std::vector<double> center_sigmas() const {
    const double mean = matrix_.trace() / static_cast<double>(parameters());
    if (!(mean > 0 && radius_ > 0) || !std::isfinite(mean)) return held_by_nothing();
    const Eigen::MatrixXd gauge = gauge_directions() * std::sqrt(mean);
    // The gauge gets a stiffness of its own, which is taken out of the inverse again; what no point
    // holds has no part in either.
    Eigen::MatrixXd stiff = matrix_ + gauge * gauge.transpose();
    stiff.diagonal().array() += 1e-12 * mean;
    for (std::size_t v = 0; v < held_.size(); ++v)
      if (!held_[v]) stiff.diagonal().segment<6>(row(v)).setConstant(mean);
    const Eigen::LLT<Eigen::MatrixXd> factor(stiff);
    if (factor.info() != Eigen::Success) return held_by_nothing();
    const Eigen::MatrixXd inverse =
        factor.solve(Eigen::MatrixXd::Identity(parameters(), parameters()));
    std::vector<double> sigmas;
    for (std::size_t v = 0; v < model_.views.size(); ++v) {
      double variance = 0;
      for (Eigen::Index k = row(v) + 3; k < row(v) + 6; ++k)
        variance += inverse(k, k) - gauge.row(k).squaredNorm() / (mean * mean);
      const Residuals& seen = residuals_[v];
      // The difference of what is equal may come out below nothing.
      sigmas.push_back(!held_[v] || seen.number == 0 || !std::isfinite(variance)
                           ? std::numeric_limits<double>::infinity()
                           : std::sqrt(std::max(0.0, variance) * seen.squares / seen.number));
    }
    return sigmas;
  }

 private:
  static std::vector<Eigen::Vector3d> centers_of(const Reconstruction& model) {
    std::vector<Eigen::Vector3d> centers;
    for (const PosedView& view : model.views) centers.push_back(camera_center(view.cam_from_world));
    return centers;
  }
  static std::vector<Eigen::Matrix3d> rotations_of(const Reconstruction& model) {
    std::vector<Eigen::Matrix3d> rotations;
    for (const PosedView& view : model.views)
      rotations.push_back(view.cam_from_world.rotation.toRotationMatrix());
    return rotations;
  }
  Eigen::Index parameters() const { return 6 * static_cast<Eigen::Index>(model_.views.size()); }
  static Eigen::Index row(std::size_t view) { return 6 * static_cast<Eigen::Index>(view); }
  std::vector<double> held_by_nothing() const {
    return std::vector<double>(model_.views.size(), std::numeric_limits<double>::infinity());
  }

  /// False where the point is not before the camera.
  bool linearize(const SparsePoint& point, const Observation& o, Linearized& out,
                 Eigen::Vector2d& residual) const {
    const PosedView& view = model_.views[at(o.view)];
    const Eigen::Vector3d x = view.cam_from_world * point.position;
    if (!(x.z() > 1e-9 * radius_) || !x.allFinite()) return false;
    residual = view.camera.project(x) - o.pixel;
    if (!residual.allFinite()) return false;
    Eigen::Matrix<double, 2, 3> by_x;
    by_x << view.camera.fx / x.z(), 0, -view.camera.fx * x.x() / (x.z() * x.z()), 0,
        view.camera.fy / x.z(), -view.camera.fy * x.y() / (x.z() * x.z());
    out.view = o.view;
    out.by_pose << -by_x * cross_matrix(x), by_x * radius_;
    out.by_point = by_x * rotations_[at(o.view)];
    return true;
  }

  void add(const SparsePoint& point) {
    std::vector<Linearized> seen;
    Eigen::Matrix3d of_point = Eigen::Matrix3d::Zero();
    for (const Observation& o : point.track) {
      Linearized line;
      Eigen::Vector2d residual;
      if (!linearize(point, o, line, residual)) continue;
      of_point += line.by_point.transpose() * line.by_point;
      seen.push_back(line);
      if (point.track.size() < 3) continue;
      residuals_[at(o.view)].squares += residual.squaredNorm();
      residuals_[at(o.view)].number += 2;
    }
    if (seen.size() < 2 || !(of_point.trace() > 0)) return;
    of_point.diagonal().array() += 1e-9 * of_point.trace();  // rays that are all but one
    const Eigen::Matrix3d freedom = of_point.inverse();
    std::vector<Pose6x3> shared;
    for (const Linearized& line : seen) shared.push_back(line.by_pose.transpose() * line.by_point);
    for (std::size_t a = 0; a < seen.size(); ++a) {
      const Eigen::Index i = row(at(seen[a].view));
      held_[at(seen[a].view)] = 1;
      matrix_.block<6, 6>(i, i) += seen[a].by_pose.transpose() * seen[a].by_pose;
      for (std::size_t b = 0; b < seen.size(); ++b)
        matrix_.block<6, 6>(i, row(at(seen[b].view))) -=
            shared[a] * freedom * shared[b].transpose();
    }
  }

  /// How the poses change when the world is turned, moved and scaled, which no pixel sees; columns
  /// of length 1, one across another.
  Eigen::MatrixXd gauge_directions() const {
    Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(parameters(), 7);
    for (std::size_t v = 0; v < model_.views.size(); ++v) {
      if (!held_[v]) continue;
      const Eigen::Matrix3d& r = rotations_[v];
      const Eigen::Vector3d t = model_.views[v].cam_from_world.translation / radius_;
      const Eigen::Index i = row(v);
      directions.block<3, 3>(i, 0) = -r;
      directions.block<3, 3>(i + 3, 0) = -cross_matrix(t) * r;
      directions.block<3, 3>(i + 3, 3) = -r;
      directions.block<3, 1>(i + 3, 6) = t;
    }
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(directions);
    return qr.householderQ() * Eigen::MatrixXd::Identity(parameters(), 7);
  }

  const Reconstruction& model_;
  const double radius_;
  const std::vector<Eigen::Matrix3d> rotations_;
  Eigen::MatrixXd matrix_;  ///< of the poses; translations in radii
  std::vector<char> held_;  ///< by a point that another view sees
  std::vector<Residuals> residuals_;
};

}  // namespace

std::vector<double> center_uncertainty(const Reconstruction& model) {
  constexpr std::size_t most_views = 400;
  if (model.views.size() < 3 || model.views.size() > most_views) return {};
  return NormalMatrix(model).center_sigmas();
}

}  // namespace orbitfuse
