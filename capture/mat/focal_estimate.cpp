// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/focal_estimate.hpp"

#include <cmath>

namespace orbitfuse {

void FocalEstimate::add(const Eigen::Matrix3d& image_from_plane, double image_width_px) {
  if (width_px_ != image_width_px) *this = {};
  width_px_ = image_width_px;
  // In units of the image width all entries are of order one; the scale of H makes views equal.
  Eigen::Matrix3d h = image_from_plane;
  h.topRows<2>() /= image_width_px;
  const double scale = 0.5 * (h.col(0).norm() + h.col(1).norm());
  if (!(scale > 0) || !h.allFinite()) return;
  h /= scale;
  const auto add_equation = [this](double a, double b) {  // a / f^2 + b = 0
    sum_bb_ += b * b;  // solved for f^2 = -a / b, which stays finite for frontal views (b = 0)
    sum_ab_ += a * b;
  };
  add_equation(h.col(0).head<2>().dot(h.col(1).head<2>()), h(2, 0) * h(2, 1));
  add_equation(h.col(0).head<2>().squaredNorm() - h.col(1).head<2>().squaredNorm(),
               h(2, 0) * h(2, 0) - h(2, 1) * h(2, 1));
}

std::optional<double> FocalEstimate::focal_px() const {
  // b is about the squared cosine of the elevation: below, corner noise speaks and not geometry.
  if (!(sum_bb_ > 1e-3)) return std::nullopt;
  const double f2 = -sum_ab_ / sum_bb_;
  if (!(f2 > 0.3 * 0.3 && f2 < 10 * 10)) return std::nullopt;
  return std::sqrt(f2) * width_px_;
}

}  // namespace orbitfuse
