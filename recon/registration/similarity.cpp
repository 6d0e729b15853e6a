// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/similarity.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace orbitfuse::registration {
namespace {

tl::unexpected<Error> degenerate(const std::string& found) {
  return fail(ErrorKind::input, "similarity", found, "give pairs that span a plane or more");
}

}  // namespace

Result<Similarity3d> umeyama(const Points& source, const Points& target,
                             const std::vector<double>& weights) {
  const std::size_t n = source.size();
  if (n != target.size() || (!weights.empty() && weights.size() != n))
    return degenerate("lists of different length");
  if (n < 3) return degenerate(fmt::format("{} pairs", n));
  const auto weight = [&](std::size_t i) { return weights.empty() ? 1.0 : weights[i]; };
  // Sums about the first point: at offsets of 4e8 the coordinates themselves would cancel.
  const Eigen::Vector3d& source_origin = source[0];
  const Eigen::Vector3d& target_origin = target[0];
  double total = 0;
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero(), target_mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    if (!source[i].allFinite() || !target[i].allFinite() || !(weight(i) >= 0))
      return degenerate(fmt::format("pair {} is not finite", i));
    total += weight(i);
    source_mean += weight(i) * (source[i] - source_origin);
    target_mean += weight(i) * (target[i] - target_origin);
  }
  if (!(total > 0)) return degenerate("no pair has weight");
  source_mean /= total;
  target_mean /= total;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero(), source_scatter = Eigen::Matrix3d::Zero(),
                  target_scatter = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d p = source[i] - source_origin - source_mean,
                          q = target[i] - target_origin - target_mean;
    covariance += weight(i) / total * q * p.transpose();
    source_scatter += weight(i) / total * p * p.transpose();
    target_scatter += weight(i) / total * q * q.transpose();
  }
  for (const Eigen::Matrix3d& scatter : {source_scatter, target_scatter}) {
    const Eigen::Vector3d spread = Eigen::JacobiSVD<Eigen::Matrix3d>(scatter).singularValues();
    if (!(spread[0] > 0)) return degenerate("all points in one place");
    if (spread[1] < 1e-12 * spread[0]) return degenerate("all points on one line");
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign(1, 1,
                       svd.matrixU().determinant() * svd.matrixV().determinant() < 0 ? -1 : 1);
  Similarity3d result;
  result.rotation = Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * sign.asDiagonal() *
                                                       svd.matrixV().transpose()))
                        .normalized();
  result.scale = svd.singularValues().dot(sign) / source_scatter.trace();
  if (!(result.scale > 0) || !std::isfinite(result.scale))
    return degenerate("pairs without a common orientation");
  result.translation = target_origin + target_mean -
                       result.scale * (result.rotation * (source_origin + source_mean));
  return result;
}

Result<RobustSimilarity> robust_umeyama(const Points& source, const Points& target,
                                        double inlier_bound) {
  if (!(inlier_bound > 0))
    return fail(ErrorKind::usage, "inlier_bound", fmt::format("{}", inlier_bound), "must be > 0");
  RobustSimilarity robust;
  robust.weights.assign(source.size(), 1.0);
  ORBITFUSE_ASSIGN(robust.target_from_source, umeyama(source, target));
  const double bound2 = inlier_bound * inlier_bound;
  const auto residuals = [&] {
    std::vector<double> r2(source.size());
    for (std::size_t i = 0; i < r2.size(); ++i)
      r2[i] = (target[i] - robust.target_from_source * source[i]).squaredNorm();
    return r2;
  };
  std::vector<double> r2 = residuals();
  const double worst = *std::max_element(r2.begin(), r2.end());
  // TLS surrogate: convex for mu -> 0, truncated least squares for mu -> infinity.
  double mu = bound2 / std::max(2 * worst - bound2, 1e-12 * bound2);
  for (int iteration = 0; iteration < 200 && mu < 1e8; ++iteration, mu *= 1.4) {
    const double low = mu / (mu + 1) * bound2, high = (mu + 1) / mu * bound2;
    for (std::size_t i = 0; i < r2.size(); ++i) {
      robust.weights[i] = r2[i] <= low    ? 1
                          : r2[i] >= high ? 0
                                          : std::sqrt(bound2 * mu * (mu + 1) / r2[i]) - mu;
    }
    const Result<Similarity3d> step = umeyama(source, target, robust.weights);
    if (!step) return tl::unexpected(step.error());
    robust.target_from_source = *step;
    r2 = residuals();
    if (worst <= bound2) break;
  }
  robust.inlier_ratio = static_cast<double>(std::count_if(r2.begin(), r2.end(),
                                                          [&](double r) { return r <= bound2; })) /
                        static_cast<double>(r2.size());
  return robust;
}

}  // namespace orbitfuse::registration
