// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/pose_error.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace orbitfuse {

Result<Similarity3d> truth_from_estimate(const std::vector<PosePair>& pairs) {
  const auto n = static_cast<Eigen::Index>(pairs.size());
  if (n < 3)
    return fail(ErrorKind::input, "ground truth", fmt::format("{} views in common", n),
                "a similarity fit needs at least three posed views that the truth names");
  Eigen::Matrix3Xd estimate(3, n), truth(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    estimate.col(i) = camera_center(pairs[static_cast<std::size_t>(i)].cam_from_estimate);
    truth.col(i) = camera_center(pairs[static_cast<std::size_t>(i)].cam_from_truth);
  }
  for (const Eigen::Matrix3Xd* centers : {&estimate, &truth}) {
    const Eigen::Matrix3Xd centered = centers->colwise() - centers->rowwise().mean();
    const Eigen::Vector3d spread = centered.jacobiSvd().singularValues();
    if (!(spread[1] > 1e-9 * spread[0]) || !(spread[0] > 0))
      return fail(ErrorKind::input, "ground truth", "camera centres on one line",
                  "a similarity fit needs cameras that span a plane");
  }
  const Eigen::Matrix4d m = Eigen::umeyama(estimate, truth, true);
  const double scale = std::cbrt(m.topLeftCorner<3, 3>().determinant());
  return Similarity3d{
      scale, Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>() / scale)).normalized(),
      m.topRightCorner<3, 1>()};
}

double extent_of_truth(const std::vector<PosePair>& pairs) {
  double largest = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      largest = std::max(
          largest,
          (camera_center(pairs[i].cam_from_truth) - camera_center(pairs[j].cam_from_truth)).norm());
  return largest;
}

PoseError pose_error(const std::vector<PosePair>& pairs, const Similarity3d& truth_from_estimate) {
  PoseError error;
  const double size = extent_of_truth(pairs);
  if (!(size > 0)) return error;  // nothing to measure centres by
  error.views = static_cast<int>(pairs.size());
  std::vector<double> offsets, angles;
  double squares = 0;
  for (const PosePair& pair : pairs) {
    const Rigid3d cam = rebase(pair.cam_from_estimate, truth_from_estimate);
    const Eigen::Vector3d off = (camera_center(cam) - camera_center(pair.cam_from_truth)) / size;
    const Eigen::Vector3d outward =
        -(pair.cam_from_truth.rotation.conjugate() * Eigen::Vector3d::UnitZ());
    squares += off.squaredNorm();
    offsets.push_back(100 * off.norm());
    angles.push_back(rotation_angle_deg(cam.rotation, pair.cam_from_truth.rotation));
    error.each.push_back({pair.name, offsets.back(), 100 * off.dot(outward), angles.back()});
  }
  std::sort(offsets.begin(), offsets.end());
  std::sort(angles.begin(), angles.end());
  const auto n = static_cast<double>(pairs.size());
  error.ate_percent = 100 * std::sqrt(squares / n);
  error.ate_median_percent = offsets[offsets.size() / 2];
  error.ate_max_percent = offsets.back();
  error.rotation_mean_deg = std::accumulate(angles.begin(), angles.end(), 0.0) / n;
  error.rotation_median_deg = angles[angles.size() / 2];
  error.rotation_max_deg = angles.back();
  return error;
}

}  // namespace orbitfuse
