// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/surface_samples.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "core/geometry/lifted.hpp"
#include "recon/assembly/looked_at.hpp"

namespace orbitfuse::measurement {
namespace {

constexpr int box_cells = 32, object_cells = 150, polygon_rays = 64;

/// One point a cell: the one that is seen from nearest by.
class Grid {
 public:
  explicit Grid(double cell) : cell_(cell) {}

  void add(const SurfacePoint& point, double pixel_size) {
    Key key{};
    for (int i = 0; i < 3; ++i)
      key[static_cast<std::size_t>(i)] = static_cast<long>(std::floor(point.position[i] / cell_));
    const auto [at, is_new] = cells_.try_emplace(key, Entry{point, pixel_size});
    if (!is_new && pixel_size < at->second.pixel_size) at->second = {point, pixel_size};
  }
  std::vector<SurfacePoint> points() const {
    std::vector<SurfacePoint> list;
    for (const auto& [key, entry] : cells_) list.push_back(entry.point);
    return list;
  }

 private:
  using Key = std::array<long, 3>;
  struct Entry {
    SurfacePoint point;
    double pixel_size;
  };
  double cell_;
  std::map<Key, Entry> cells_;  // in order, so that the same scene gives the same list
};

/// All surface points of all thermal frames' depth maps that lie in a region.
Result<std::vector<SurfacePoint>> seen_in(const ThermalScene& scene, double cell,
                                          const std::function<bool(const Eigen::Vector3d&)>& within,
                                          const Progress& progress) {
  Grid grid(cell);
  for (std::size_t f = 0; f < scene.frames().size(); ++f) {
    ORBITFUSE_ASSIGN(const FieldView seen, scene.seen(f, progress));
    const Camera camera = scene.reduced_camera(f);
    const Rigid3d world_from_cam = scene.frames()[f].view.cam_from_world.inverse();
    for (int y = 0; y < seen.depth.rows; ++y)
      for (int x = 0; x < seen.depth.cols; ++x) {
        const auto z = static_cast<double>(seen.depth.at<float>(y, x));
        if (!(z > 0) || !std::isfinite(z)) continue;
        SurfacePoint point;
        point.position = world_from_cam * lifted(seen.depth, camera, x, y);
        if (!within(point.position)) continue;
        const auto normal = normal_at(seen.depth, camera, x, y, normal_reach);
        if (!normal) continue;  // a lone pixel
        point.normal = world_from_cam.rotation * *normal;
        point.field_k = static_cast<double>(seen.temperature_k.at<float>(y, x));
        point.variation_k = variation_at(seen.temperature_k, x, y, 1);
        // A plane meets a grid's cells as often as their walls: more of them where it is aslant.
        point.weight = 1 / point.normal.cwiseAbs().sum();
        const double cosine = std::abs(normal->dot(camera.ray_of({x + 0.5, y + 0.5}).normalized()));
        grid.add(point, z / camera.fx / std::max(0.05, cosine));
      }
  }
  return grid.points();
}

bool is_inside(const std::vector<Eigen::Vector2d>& corners, const Eigen::Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
    const Eigen::Vector2d &a = corners[i], &b = corners[j];
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x())
      inside = !inside;
  }
  return inside;
}

/// Twice the area that three points go round, with its sense.
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

}  // namespace

bool crosses_itself(const std::vector<Eigen::Vector2d>& corners) {
  const std::size_t n = corners.size();
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j) {
      const Eigen::Vector2d &a = corners[i], &b = corners[(i + 1) % n], &c = corners[j],
                            &d = corners[(j + 1) % n];
      if (turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0) return true;
    }
  return false;
}

double object_radius(const ThermalScene::Middle& middle) { return object_reach * middle.radius; }

Result<std::vector<SurfacePoint>> box_samples(const ThermalScene& scene, const OrientedBox& box,
                                              const Progress& progress) {
  const Eigen::Quaterniond box_from_world = box.rotation.normalized().conjugate();
  // A box may reach far beyond what is in it; its cells must not grow with it.
  double side = box.size.maxCoeff();
  if (scene.middle()) side = std::min(side, 2 * object_radius(*scene.middle()));
  return seen_in(
      scene, side / box_cells,
      [&](const Eigen::Vector3d& p) {
        const Eigen::Vector3d in_box = box_from_world * (p - box.center);
        return (in_box.array().abs() <= 0.5 * box.size.array()).all();
      },
      progress);
}

Result<std::vector<SurfacePoint>> object_samples(const ThermalScene& scene,
                                                 const Progress& progress) {
  if (!scene.middle())
    return fail(ErrorKind::input, "the object", "the cameras' axes meet nowhere",
                "measure a box, a polygon or a spot instead");
  const ThermalScene::Middle& middle = *scene.middle();
  const double radius = object_radius(middle);
  return seen_in(
      scene, radius / object_cells,
      [&](const Eigen::Vector3d& p) { return (p - middle.center).norm() <= radius; }, progress);
}

Result<std::vector<SurfacePoint>> polygon_samples(const ThermalScene& scene, const PosedView& view,
                                                  const std::vector<Eigen::Vector2d>& corners,
                                                  const Progress& progress) {
  Eigen::Vector2d low = corners.at(0), high = corners[0];
  for (const Eigen::Vector2d& corner : corners)
    low = low.cwiseMin(corner), high = high.cwiseMax(corner);
  low = low.cwiseMax(Eigen::Vector2d::Zero());
  high = high.cwiseMin(Eigen::Vector2d(view.camera.width, view.camera.height));
  const Eigen::Vector2d size = high - low;
  if (!(size.minCoeff() > 0))
    return fail(ErrorKind::input, "polygon in " + view.name, "it has no area within the picture",
                fmt::format("choose corners within 0..{} and 0..{}", view.camera.width,
                            view.camera.height));
  // The polygon's part of the picture, with fewer pixels where it is large.
  const double factor = std::min(1.0, polygon_rays / size.maxCoeff());
  Camera part = view.camera;
  part.width = std::max(1, static_cast<int>(std::lround(size.x() * factor)));
  part.height = std::max(1, static_cast<int>(std::lround(size.y() * factor)));
  const double sx = part.width / size.x(), sy = part.height / size.y();
  part.fx *= sx, part.fy *= sy;
  part.cx = (part.cx - low.x()) * sx, part.cy = (part.cy - low.y()) * sy;
  ORBITFUSE_ASSIGN(const FieldView seen, scene.render(part, view.cam_from_world, progress));
  const Rigid3d world_from_cam = view.cam_from_world.inverse();
  std::vector<SurfacePoint> points;
  for (int y = 0; y < part.height; ++y)
    for (int x = 0; x < part.width; ++x) {
      const auto z = static_cast<double>(seen.depth.at<float>(y, x));
      const Eigen::Vector2d pixel(low.x() + (x + 0.5) / sx, low.y() + (y + 0.5) / sy);
      if (!(z > 0) || !std::isfinite(z) || !is_inside(corners, pixel)) continue;
      const Eigen::Vector3d ray = part.ray_of({x + 0.5, y + 0.5});
      const auto normal = normal_at(seen.depth, part, x, y, normal_reach);
      if (!ray.allFinite()) continue;
      SurfacePoint point;
      point.position = world_from_cam * lifted(seen.depth, part, x, y);
      point.normal = world_from_cam.rotation * normal.value_or(-ray.normalized());
      point.field_k = static_cast<double>(seen.temperature_k.at<float>(y, x));
      const double cosine = normal ? std::abs(normal->dot(ray.normalized())) : 1;
      point.weight = z * z / std::max(0.05, cosine);
      points.push_back(point);
    }
  return points;
}

}  // namespace orbitfuse::measurement
