// SPDX-License-Identifier: BSD-3-Clause
#include "recon/comparison/surface_change.hpp"

#include <cmath>
#include <numbers>

#include "core/numeric/median.hpp"
#include "core/system/parallel.hpp"
#include "recon/comparison/surface_points.hpp"
#include "recon/surface/surface.hpp"

namespace orbitfuse::comparison {
namespace {

/// Mean distance to standard deviation, of a normal distribution.
constexpr double sigma_of_mean = 1.2533;

struct Seen {
  cv::Mat depth;
  Eigen::Vector3d eye;
};

/// Noise as sigmas, with the median where it is not known.
std::vector<double> sigmas(const std::vector<float>& noise) {
  std::vector<double> known, result;
  for (const float n : noise)
    if (std::isfinite(n)) known.push_back(static_cast<double>(n));
  const double middle = median(known);
  for (const float n : noise)
    result.push_back(sigma_of_mean * (std::isfinite(n) ? static_cast<double>(n) : middle));
  return result;
}

Status check(const KnownSurface& surface, const char* which) {
  if (!surface.mesh || surface.mesh->empty())
    return fail(ErrorKind::input, which, "a surface without triangles", "reconstruct it first");
  const PointCloud& v = surface.mesh->vertices;
  if (v.normals.size() != v.size() || surface.depth_noise.size() != v.size())
    return fail(ErrorKind::input, which, "normals or depth noise that are not one a vertex",
                "take a field_surface with depth_noise");
  return {};
}

/// Views of the other run that look through the place, `tolerance` or more before what they see.
int views_through(const Eigen::Vector3d& x, const Eigen::Vector3d& normal, double tolerance,
                  const std::vector<PosedView>& views, const std::vector<Seen>& seen,
                  double least_cosine) {
  int through = 0;
  for (std::size_t k = 0; k < views.size(); ++k) {
    if (!((seen[k].eye - x).normalized().dot(normal) > least_cosine)) continue;
    const Eigen::Vector3d in_cam = views[k].cam_from_world * x;
    const Eigen::Vector2d pixel = views[k].camera.project(in_cam);
    const cv::Mat& depth = seen[k].depth;
    const int u = static_cast<int>(std::floor(pixel.x())),
              v = static_cast<int>(std::floor(pixel.y()));
    if (!pixel.allFinite() || u < 1 || v < 1 || u >= depth.cols - 1 || v >= depth.rows - 1)
      continue;
    // All round it: beside an edge a pixel's error would show another surface.
    bool free = true;
    for (int y = v - 1; y <= v + 1; ++y)
      for (int w = u - 1; w <= u + 1; ++w)
        free &= static_cast<double>(depth.at<float>(y, w)) > in_cam.z() + tolerance;
    through += free;
  }
  return through;
}

}  // namespace

const char* name(SurfaceChange change) {
  switch (change) {
    case SurfaceChange::same:
      return "same";
    case SurfaceChange::changed:
      return "changed";
    case SurfaceChange::not_seen:
      return "not seen";
  }
  return "";
}

Result<std::vector<SurfaceChange>> surface_change(const KnownSurface& surface,
                                                  const KnownSurface& other,
                                                  const Similarity3d& other_from_surface,
                                                  const ComparisonOptions& options,
                                                  const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(check(surface, "the surface"));
  ORBITFUSE_TRY(check(other, "the other surface"));
  if (!other_from_surface.is_finite() || !(other_from_surface.scale > 0))
    return fail(ErrorKind::input, "the registration", "no similarity", "register the runs first");
  std::vector<Seen> seen(other.views.size());
  parallel_for(static_cast<int>(seen.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    if (progress.cancelled()) return;
    seen[k] = {mesh_depth(*other.mesh, other.views[k]),
               camera_center(other.views[k].cam_from_world)};
  });
  ORBITFUSE_TRY(progress.check("compare"));
  const SurfacePoints there = surface_points(*other.mesh);
  if (there.size() == 0)
    return fail(ErrorKind::input, "the other surface", "no vertex with a normal", "reconstruct it");
  const KdTree tree(there.positions);
  const double least = options.least_change * diagonal(there);
  const double least_cosine = std::cos(options.max_angle_deg * std::numbers::pi / 180);
  const std::vector<double> own = sigmas(surface.depth_noise), others = sigmas(other.depth_noise);
  const PointCloud& vertices = surface.mesh->vertices;
  std::vector<SurfaceChange> result(vertices.size(), SurfaceChange::not_seen);
  parallel_blocks(static_cast<int>(vertices.size()), 1024, [&](int begin, int end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const Eigen::Vector3d x = other_from_surface * vertices.positions[i];
      if (!x.allFinite() || !vertices.normals[i].allFinite()) continue;
      std::size_t nearest = 0;
      double d2 = 0;
      tree.nearest(x, 1, &nearest, &d2);
      const double tolerance =
          std::max(least, options.change_sigmas * std::hypot(other_from_surface.scale * own[i],
                                                             others[there.index[nearest]]));
      if (distance_to(there, tree, x) <= tolerance)
        result[i] = SurfaceChange::same;
      else if (views_through(x, other_from_surface.rotation * vertices.normals[i].cast<double>(),
                             tolerance, other.views, seen, least_cosine) >= options.least_views)
        result[i] = SurfaceChange::changed;
    }
  });
  return result;
}

}  // namespace orbitfuse::comparison
