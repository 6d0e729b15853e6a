// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/looked_at.hpp"

#include <cmath>
#include <limits>

#include "core/geometry/lifted.hpp"
#include "recon/assembly/new_views.hpp"

namespace orbitfuse {
namespace {

constexpr double least_share =
    0.05;  // of the measured samples, for an orbit's centre to be believed

/// One view's part within `radius` of `center`.
cv::Mat near_part(const ThermalView& seen, const Eigen::Vector3d& center, double radius) {
  cv::Mat result = seen.thermal.clone();
  const Eigen::Vector3d center_in_cam = seen.view.cam_from_world * center;
  for (int y = 0; y < result.rows; ++y)
    for (int x = 0; x < result.cols; ++x) {
      const Eigen::Vector3d point = lifted(seen.depth, seen.view.camera, x, y);
      // Also where the depth is unknown.
      if (!((point - center_in_cam).norm() <= radius))
        result.at<float>(y, x) = std::numeric_limits<float>::quiet_NaN();
    }
  return result;
}

int finite_samples(const std::vector<cv::Mat>& images) {
  int count = 0;
  for (const cv::Mat& image : images) count += cv::countNonZero(image == image);
  return count;
}

}  // namespace

std::vector<cv::Mat> within_orbit(const std::vector<ThermalView>& views,
                                  const std::vector<PosedView>& orbit, double reach) {
  std::vector<cv::Mat> whole, parts;
  for (const ThermalView& view : views) whole.push_back(view.thermal);
  const auto geometry = orbit_geometry(orbit);
  if (!geometry) return whole;
  for (const ThermalView& view : views) {
    CV_Assert(view.thermal.type() == CV_32FC1 && view.depth.type() == CV_32FC1 &&
              view.depth.size() == view.thermal.size());
    parts.push_back(near_part(view, geometry->center, reach * geometry->radius));
  }
  return finite_samples(parts) >= least_share * finite_samples(whole) ? parts : whole;
}

TemperatureSpan object_span(const std::vector<ThermalView>& views,
                            const std::vector<PosedView>& orbit) {
  return common_span(within_orbit(views, orbit, object_reach), 0.5, 99.99);
}

}  // namespace orbitfuse
