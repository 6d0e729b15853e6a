// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/geometry/lifted.hpp"
#include "core/numeric/bilinear.hpp"
#include "core/system/parallel.hpp"
#include "recon/surface/distance_grid.hpp"
#include "recon/surface/surface.hpp"
#include "recon/surface/surface_nets.hpp"

namespace orbitfuse {
namespace {

/// Neighbouring depths that differ by more, per pixel and as a share, lie on two surfaces.
constexpr float step_share = 0.02F;

/// A depth map made ready: what each pixel's depth is worth.
struct Prepared {
  const SurfaceView* source;
  Eigen::Matrix3f cam_from_world;
  Eigen::Vector3f translation;
  cv::Mat weight;  ///< CV_32FC1: cosine to the surface's normal; 0: not to be used
};

bool known(float depth) { return std::isfinite(depth) && depth > 0; }

Eigen::Vector3d lifted(const SurfaceView& s, int x, int y) {
  return orbitfuse::lifted(s.depth, s.view.camera, x, y);
}

/// Cosine between ray and normal; 0 beside a step, the border or an unknown depth.
float cosine_at(const SurfaceView& s, int x, int y) {
  if (x < 1 || y < 1 || x + 1 >= s.depth.cols || y + 1 >= s.depth.rows) return 0;
  const float z = s.depth.at<float>(y, x);
  if (!known(z)) return 0;
  for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
    if (const float beside = s.depth.at<float>(y + dy, x + dx);
        !known(beside) || !(std::abs(beside - z) < 4 * step_share * z))
      return 0;
  const Eigen::Vector3d normal =
      (lifted(s, x + 1, y) - lifted(s, x - 1, y)).cross(lifted(s, x, y + 1) - lifted(s, x, y - 1));
  const double length = normal.norm();
  if (!(length > 0)) return 0;
  return static_cast<float>(std::abs(normal.dot(lifted(s, x, y).normalized())) / length);
}

Prepared prepared(const SurfaceView& s, double max_angle_deg) {
  Prepared p{&s, s.view.cam_from_world.rotation.toRotationMatrix().cast<float>(),
             s.view.cam_from_world.translation.cast<float>(), cv::Mat(s.depth.size(), CV_32FC1)};
  const auto least = static_cast<float>(std::cos(max_angle_deg * std::numbers::pi / 180));
  for (int y = 0; y < s.depth.rows; ++y)
    for (int x = 0; x < s.depth.cols; ++x) {
      const float cosine = cosine_at(s, x, y);
      p.weight.at<float>(y, x) = cosine >= least ? cosine : 0;
    }
  return p;
}

/// Between the four pixels round it; nothing where they lie on two surfaces.
float depth_between(const cv::Mat& depth, float u, float v) {
  const auto place = place_among<float>(depth.cols, depth.rows, u - 0.5F, v - 0.5F);
  if (!place) return 0;
  const float* top = depth.ptr<float>(place->y0) + place->x0;
  const float* bottom = depth.ptr<float>(place->y1) + place->x0;
  const auto [low, high] = std::minmax({top[0], top[1], bottom[0], bottom[1]});
  if (!(low > 0 && high - low < 4 * step_share * low)) return 0;  // NaN too
  return blended(*place, [&](int y, int x) { return depth.at<float>(y, x); });
}

/// One view's word about a voxel: distances along the ray, shortened to the normal's by the cosine.
void add(const Prepared& p, const Eigen::Vector3f& world, float truncation,
         DistanceGrid::Voxel& voxel) {
  const Eigen::Vector3f x = p.cam_from_world * world + p.translation;
  if (!(x.z() > 0)) return;
  const Camera& c = p.source->view.camera;
  const float u = static_cast<float>(c.fx) * x.x() / x.z() + static_cast<float>(c.cx);
  const float v = static_cast<float>(c.fy) * x.y() / x.z() + static_cast<float>(c.cy);
  const cv::Mat& depth = p.source->depth;
  if (!(u >= 0 && v >= 0 && u < static_cast<float>(depth.cols) &&
        v < static_cast<float>(depth.rows)))
    return;
  const float weight = p.weight.at<float>(static_cast<int>(v), static_cast<int>(u));
  if (!(weight > 0)) return;
  const float z = depth_between(depth, u, v);
  if (!(z > 0)) return;
  const float distance = (z - x.z()) * x.norm() / x.z() * weight;
  if (distance < -truncation) return;
  // The farther behind the surface, the likelier it is another one that the voxel belongs to; and
  // just behind an object's limb such words would swell it.
  const float share = distance / truncation;
  const float counts = weight * weight * (share < 0 ? 1 + share : 1);
  if (!(counts > 0)) return;
  voxel.distance += (std::min(1.0F, share) - voxel.distance) * counts / (voxel.weight + counts);
  voxel.weight += counts;
}

Status check(const std::vector<SurfaceView>& views, const Eigen::AlignedBox3d& box) {
  if (box.isEmpty() || !box.min().allFinite() || !box.max().allFinite() ||
      !(box.sizes().minCoeff() > 0) || !(box.sizes().maxCoeff() < 1e9))
    return fail(ErrorKind::input, "surface box", "empty or not finite",
                "give a box whose sides are lengths in the scene");
  for (const SurfaceView& s : views) {
    const Camera& c = s.view.camera;
    if (s.depth.type() != CV_32FC1 || s.depth.cols != c.width || s.depth.rows != c.height ||
        c.has_distortion())
      return fail(ErrorKind::input, s.view.name, "a depth map that is not of its camera",
                  "render it again with that camera, without distortion");
    ORBITFUSE_TRY(c.validate(s.view.name));
    if (!s.view.cam_from_world.is_finite())
      return fail(ErrorKind::input, s.view.name, "a pose that is not finite", "pose it again");
  }
  return {};
}

void hold_seen(const std::vector<Prepared>& views, const Eigen::AlignedBox3d& box,
               double truncation, DistanceGrid& grid) {
  for (const Prepared& p : views) {
    const Rigid3d world_from_cam = p.source->view.cam_from_world.inverse();
    for (int y = 0; y < p.weight.rows; ++y)
      for (int x = 0; x < p.weight.cols; ++x) {
        if (!(p.weight.at<float>(y, x) > 0)) continue;
        const Eigen::Vector3d point = world_from_cam * lifted(*p.source, x, y);
        if (box.contains(point)) grid.hold(point, truncation);
      }
  }
}

}  // namespace

Result<TriangleMesh> fuse_depth(const std::vector<SurfaceView>& views,
                                const Eigen::AlignedBox3d& box, const SurfaceOptions& options,
                                const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(check(views, box));
  std::vector<Prepared> ready(views.size());
  parallel_for(static_cast<int>(views.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    ready[k] = prepared(views[k], options.max_angle_deg);
  });
  DistanceGrid grid(box, options.resolution);
  const double truncation = options.truncation_voxels * grid.voxel_size();
  hold_seen(ready, box, truncation, grid);
  grid.allocate();
  ORBITFUSE_TRY(progress.check("surface"));
  parallel_for(static_cast<int>(grid.size()), [&](int i) {
    if (progress.cancelled()) return;
    const auto b = static_cast<std::size_t>(i);
    const Eigen::Array3i first = grid.first_voxel(b);
    DistanceGrid::Block& block = grid.block(b);
    for (int k = 0; k < DistanceGrid::block_voxels; ++k) {
      constexpr int side = DistanceGrid::block_side;
      const Eigen::Array3i offset(k % side, k / side % side, k / (side * side));
      const Eigen::Vector3f world = grid.position(first + offset).cast<float>();
      for (const Prepared& p : ready)
        add(p, world, static_cast<float>(truncation), block[static_cast<std::size_t>(k)]);
    }
  });
  ORBITFUSE_TRY(progress.check("surface"));
  TriangleMesh mesh = surface_net(grid, static_cast<float>(options.least_weight), box);
  if (mesh.empty())
    return fail(ErrorKind::quality, "surface",
                fmt::format("none of {} views sees a surface in the box", views.size()),
                "choose a larger box, or train the visible field longer");
  return mesh;
}

}  // namespace orbitfuse
