// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/ground/ground_plane.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/numeric/random.hpp"

namespace orbitfuse::depth {
namespace {

constexpr int sample_step_px = 4;
constexpr int trials = 400;
constexpr std::uint64_t stream = 71;
/// Of the scene radius: gravel, grass and the depth's own error.
constexpr float thickness = 0.015f;
/// An operator holds the camera upright to this.
constexpr float max_tilt_cos = 0.85f;
/// A ground is a good part of what is seen; a table top or a platform's roof is less, and has
/// something below it.
constexpr double min_share = 0.1, max_below = 0.03;
constexpr float min_camera_height = 0.03f;

std::vector<Eigen::Vector3f> confirmed_points(const std::vector<DepthView>& views,
                                              const std::vector<DepthMap>& maps) {
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < views.size(); ++i)
    for (int y = 0; y < maps[i].depth.rows; y += sample_step_px)
      for (int x = 0; x < maps[i].depth.cols; x += sample_step_px)
        if (const float z = maps[i].depth.at<float>(y, x); std::isfinite(z))
          points.push_back(world_of(views[i], {x + 0.5, y + 0.5}, z));
  return points;
}

Eigen::Vector3f mean_up(const std::vector<DepthView>& views) {
  Eigen::Vector3f up = Eigen::Vector3f::Zero();
  for (const DepthView& view : views) up -= view.world_rotation.row(1).transpose();
  return up.normalized();
}

bool under_the_cameras(const OpenGround& plane, const std::vector<DepthView>& views) {
  return std::all_of(views.begin(), views.end(), [&](const DepthView& view) {
    return plane.height(view.center()) > min_camera_height;
  });
}

struct Votes {
  std::size_t on = 0, below = 0;
};

Votes votes(const OpenGround& plane, const std::vector<Eigen::Vector3f>& points) {
  Votes out;
  for (const Eigen::Vector3f& x : points) {
    const float h = plane.height(x);
    out.on += std::abs(h) < thickness;
    out.below += h < -3 * thickness;
  }
  return out;
}

OpenGround fitted(const OpenGround& near, const std::vector<Eigen::Vector3f>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  double count = 0;
  for (const Eigen::Vector3f& x : points) {
    if (std::abs(near.height(x)) > thickness) continue;
    const Eigen::Vector3d p = x.cast<double>();
    sum += p;
    squares += p * p.transpose();
    ++count;
  }
  const Eigen::Vector3d mean = sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares / count -
                                                            mean * mean.transpose());
  OpenGround plane;
  plane.normal = axes.eigenvectors().col(0).cast<float>();
  if (plane.normal.dot(near.normal) < 0) plane.normal = -plane.normal;
  plane.offset = -plane.normal.dot(mean.cast<float>());
  return plane;
}

tl::unexpected<Error> no_ground(std::string found) {
  return fail(ErrorKind::quality, "ground", std::move(found), "depth is not extended");
}

}  // namespace

Result<OpenGround> find_ground(const std::vector<DepthView>& views,
                               const std::vector<DepthMap>& maps, std::uint64_t seed) {
  const std::vector<Eigen::Vector3f> points = confirmed_points(views, maps);
  if (points.size() < 1000) return no_ground(fmt::format("{} confirmed depths", points.size()));
  const Eigen::Vector3f up = mean_up(views);
  OpenGround best;
  Votes most;
  for (int trial = 0; trial < trials; ++trial) {
    const auto draw = [&](int k) {
      return points[random_bits(seed, stream, static_cast<std::uint64_t>(3 * trial + k)) %
                    points.size()];
    };
    const Eigen::Vector3f a = draw(0), b = draw(1), c = draw(2);
    Eigen::Vector3f normal = (b - a).cross(c - a);
    if (!(normal.norm() > 1e-3f)) continue;
    normal.normalize();
    if (normal.dot(up) < 0) normal = -normal;
    if (!(normal.dot(up) > max_tilt_cos)) continue;
    const OpenGround plane{normal, -normal.dot(a)};
    if (!under_the_cameras(plane, views)) continue;
    const Votes found = votes(plane, points);
    if (found.on > most.on) best = plane, most = found;
  }
  if (most.on == 0) return no_ground("no plane under all cameras");
  for (int round = 0; round < 2; ++round) best = fitted(best, points);
  most = votes(best, points);
  const double all = static_cast<double>(points.size());
  if (!(static_cast<double>(most.on) > min_share * all) ||
      static_cast<double>(most.below) > max_below * all || !under_the_cameras(best, views))
    return no_ground(fmt::format("{:.1f} % of the depths on the largest plane, {:.1f} % below it",
                                 100 * static_cast<double>(most.on) / all,
                                 100 * static_cast<double>(most.below) / all));
  return best;
}

}  // namespace orbitfuse::depth
