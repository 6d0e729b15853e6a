// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/stereo/consistency.hpp"

#include <cmath>
#include <limits>

#include "core/system/parallel.hpp"

namespace orbitfuse::depth {
namespace {

struct Seen {
  bool agrees = false;
  bool hides = false;  ///< the point lies clearly in front of what the other view matched well
};

Seen seen_from(const DepthView& from, const Eigen::Vector2d& pixel, float depth,
               const DepthView& other, const PlaneMap& planes, const DepthOptions& options) {
  const Eigen::Vector3f x = world_of(from, pixel, depth);
  const Eigen::Vector3f c = other.world_rotation * x + other.translation;
  if (!(c.z() > 0)) return {};
  const Eigen::Vector2d at = other.camera.project(c.cast<double>());
  if (!(at.x() >= 0 && at.y() >= 0 && at.x() < planes.width && at.y() < planes.height)) return {};
  const std::size_t there = planes.at(static_cast<int>(at.x()), static_cast<int>(at.y()));
  if (!(planes.cost[there] < options.max_cost)) return {};
  const float found = planes.plane[there].depth;
  const float difference = (c.z() - found) / found;
  if (std::abs(difference) > options.agreement) return {false, difference < -0.05f};
  const Eigen::Vector3f back = from.world_rotation * world_of(other, at, found) + from.translation;
  const Eigen::Vector2d again = from.camera.project(back.cast<double>());
  return {(again - pixel).norm() <= options.agreement_px, false};
}

}  // namespace

std::vector<DepthMap> confirmed_depths(const std::vector<DepthView>& views,
                                       const std::vector<PlaneMap>& planes,
                                       const std::vector<std::vector<int>>& neighbours,
                                       const DepthOptions& options) {
  std::vector<DepthMap> out(views.size());
  parallel_for(static_cast<int>(views.size()), [&](int v) {
    const auto i = static_cast<std::size_t>(v);
    const PlaneMap& own = planes[i];
    DepthMap& map = out[i];
    map.view = v;
    map.camera = views[i].camera;
    map.depth.create(own.height, own.width, CV_32FC1);
    map.depth.setTo(std::numeric_limits<float>::quiet_NaN());
    map.confidence = cv::Mat::zeros(own.height, own.width, CV_32FC1);
    map.normal = cv::Mat::zeros(own.height, own.width, CV_32FC3);
    for (int y = 0; y < own.height; ++y)
      for (int x = 0; x < own.width; ++x) {
        const std::size_t p = own.at(x, y);
        if (!(own.cost[p] < options.max_cost)) continue;
        int agreeing = 0, hiding = 0;
        for (const int other : neighbours[i]) {
          const auto j = static_cast<std::size_t>(other);
          const Seen seen = seen_from(views[i], {x + 0.5, y + 0.5}, own.plane[p].depth, views[j],
                                      planes[j], options);
          agreeing += seen.agrees;
          hiding += seen.hides;
        }
        if (agreeing < options.min_agreeing || hiding > agreeing) continue;
        map.depth.at<float>(y, x) = own.plane[p].depth;
        // One view that agrees may be a coincidence, three are not.
        map.confidence.at<float>(y, x) =
            (1 - own.cost[p]) * (1 - std::exp2(-static_cast<float>(agreeing) - 1));
        const Eigen::Vector3f& n = own.plane[p].normal;
        map.normal.at<cv::Vec3f>(y, x) = {n.x(), n.y(), n.z()};
      }
  });
  return out;
}

}  // namespace orbitfuse::depth
