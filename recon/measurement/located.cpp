// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/located.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/geometry/lens_fold.hpp"
#include "core/numeric/median.hpp"
#include "recon/assembly/looked_at.hpp"

namespace orbitfuse::measurement {
namespace {

constexpr double pointing_px = 1;      // how well a pixel is pointed at
constexpr double depth_share = 0.003;  // of a field's depth at its best (docs/benchmarks/export.md)
constexpr double off_weight = 1.5;     // of what other views' depths are off by
constexpr double unconfirmed_share = 0.03;  // of a depth that too few other views see
constexpr std::size_t least_others = 2;
constexpr double point_share = 0.002;  // of the orbit's radius: what a given point may be off
constexpr double other_surface = 0.1;  // of a depth: farther apart it is another surface

/// The depth where a view's ray goes, and how much it varies from pixel to pixel.
struct SeenDepth {
  double z = 0, scatter = 0;
  Eigen::Vector3d ray;  ///< in the camera, z = 1
  double fx = 0;
};

/// Nothing where too few pixels have a depth.
Result<std::optional<SeenDepth>> depth_at(const DepthRenderer& depth, const PosedView& view,
                                          const Eigen::Vector2d& normalized,
                                          const Progress& progress) {
  // A picture of a few pixels round the place is all that has to be rendered.
  // As many as the camera's focal length needs for a picture that a lens could have taken.
  Camera small = view.camera.without_distortion();
  const int half = std::max(2, static_cast<int>(small.fx / 200)), side = 2 * half + 1;
  small.width = small.height = side;
  small.cx = side / 2.0 - small.fx * normalized.x();
  small.cy = side / 2.0 - small.fy * normalized.y();
  ORBITFUSE_ASSIGN(const cv::Mat seen, depth(small, view.cam_from_world, progress));
  std::vector<double> depths;
  for (int y = half - 1; y <= half + 1; ++y)
    for (int x = half - 1; x <= half + 1; ++x)
      if (const float z = seen.at<float>(y, x); std::isfinite(z))
        depths.push_back(static_cast<double>(z));
  if (depths.size() < 5) return std::nullopt;
  SeenDepth found;
  found.z = median(depths);
  for (double& d : depths) d = std::abs(d - found.z);
  found.scatter = median(depths);
  found.ray = small.ray_of({side / 2.0, side / 2.0});
  found.fx = small.fx;
  return found;
}

bool in_picture(const PosedView& view, const Eigen::Vector3d& in_cam) {
  if (!(in_cam.z() > 0 && lens_holds(view.camera, in_cam))) return false;
  const Eigen::Vector2d pixel = view.camera.project(in_cam);
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < view.camera.width &&
         pixel.y() < view.camera.height;
}

/// What the depths of other views say of a point, those in `order` first.
struct OtherViews {
  /// The middle of all views, the point's own (0) among them; each along its own axis, taken for
  /// what it is along the point's ray: views from far aside are not asked.
  double farther = 0;
  double off = 0;          ///< three quarters of them are off by no more
  std::size_t number = 0;  ///< that see it
};

/// `looks_past`: views that see a surface far behind the point count too, as for a pixel at an edge
/// they must; a given point they say nothing of.
Result<OtherViews> other_views(const DepthRenderer& depth,
                               const std::vector<const PosedView*>& order,
                               const Eigen::Vector3d& point, bool looks_past,
                               const Progress& progress) {
  constexpr std::size_t enough = 12;
  std::vector<double> farther{0}, off;
  for (const PosedView* view : order) {
    if (off.size() >= enough) break;
    const Eigen::Vector3d in_cam = view->cam_from_world * point;
    if (!in_picture(*view, in_cam)) continue;
    ORBITFUSE_ASSIGN(const auto seen,
                     depth_at(depth, *view, in_cam.head<2>() / in_cam.z(), progress));
    if (!seen || seen->z < in_cam.z() * (1 - other_surface)) continue;
    if (!looks_past && seen->z > in_cam.z() * (1 + other_surface)) continue;
    farther.push_back(seen->z - in_cam.z());
    off.push_back(std::abs(farther.back()));
  }
  if (off.empty()) return OtherViews{};
  std::sort(off.begin(), off.end());
  return OtherViews{median(farther), off[off.size() * 3 / 4], off.size()};
}

/// Those that look from about where `self` does, nearest first, without itself.
std::vector<const PosedView*> from_its_side(const std::vector<PosedView>& views,
                                            const PosedView& self, const Eigen::Vector3d& point) {
  constexpr double most_turn_deg = 80;
  const auto direction = [&](const PosedView& view) -> Eigen::Vector3d {
    return (camera_center(view.cam_from_world) - point).normalized();
  };
  const Eigen::Vector3d from = direction(self);
  std::vector<std::pair<double, const PosedView*>> turned;
  for (const PosedView& view : views)
    if (const double cosine = direction(view).dot(from);
        view.name != self.name && cosine > std::cos(most_turn_deg * std::numbers::pi / 180))
      turned.emplace_back(-cosine, &view);
  std::sort(turned.begin(), turned.end());
  std::vector<const PosedView*> order;
  for (const auto& [cosine, view] : turned) order.push_back(view);
  return order;
}

}  // namespace

double Located::variance_along(const Eigen::Vector3d& direction) const {
  const double part = direction.dot(ray);
  return across * across * (1 - part * part) + along * along * part * part;
}

Apart apart(const Located& a, const Located& b) {
  const Eigen::Vector3d between = b.position - a.position;
  const double length = between.norm();
  const Eigen::Vector3d direction =
      length > 0 ? Eigen::Vector3d(between / length) : Eigen::Vector3d::UnitX();
  const auto all = [](const Located& p) { return 2 * p.across * p.across + p.along * p.along; };
  const double in_line = a.variance_along(direction) + b.variance_along(direction);
  const double beside = std::max(all(a) + all(b) - in_line, 0.0);
  // What lies beside a line that is not much longer makes it longer too.
  return {length, std::hypot(std::sqrt(in_line), std::sqrt(length * length + beside) - length)};
}

Status check_in_scene(const Eigen::Vector3d& point, const Eigen::Vector3d& center, double radius) {
  const auto words = [](const Eigen::Vector3d& p) {
    return fmt::format("{:.4g},{:.4g},{:.4g}", p.x(), p.y(), p.z());
  };
  if (!point.allFinite())
    return fail(ErrorKind::input, "point " + words(point), "not finite", "write X,Y,Z");
  const double off = (point - center).norm();
  if (off <= surroundings_reach * radius) return {};
  return fail(ErrorKind::input, "point " + words(point),
              fmt::format("outside of the scene: {:.3g} from its middle, the cameras stand {:.3g} "
                          "from it",
                          off, radius),
              fmt::format("give coordinates of this run's world, the scene's middle is {}; or a "
                          "pixel of a recorded view",
                          words(center)));
}

Result<std::string> pixel_words(const PosedView& view, const Eigen::Vector2d& pixel) {
  std::string where = fmt::format("pixel {:g},{:g} of {}", pixel.x(), pixel.y(), view.name);
  const Camera& camera = view.camera;
  if (pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= camera.width && pixel.y() <= camera.height)
    return where;
  return fail(ErrorKind::input, where, "outside of the picture",
              fmt::format("choose u within 0..{} and v within 0..{}", camera.width, camera.height));
}

Result<Located> located(const SurfaceSource& source, const PosedView& view,
                        const Eigen::Vector2d& pixel, const Progress& progress) {
  ORBITFUSE_ASSIGN(const std::string where, pixel_words(view, pixel));
  const Eigen::Vector2d at = view.camera.normalized_of(pixel);
  if (!at.allFinite())
    return fail(ErrorKind::input, where, "beyond where the lens is known",
                "choose one nearer to the middle");
  ORBITFUSE_ASSIGN(const auto seen, depth_at(source.depth, view, at, progress));
  if (!seen)
    return fail(ErrorKind::input, where, "the field has no surface there (sky, or a hole in it)",
                "choose a pixel on the object");
  const Rigid3d world_from_cam = view.cam_from_world.inverse();
  Located out{world_from_cam * (seen->z * seen->ray),
              world_from_cam.rotation * seen->ray.normalized(), pointing_px * seen->z / seen->fx,
              std::max(depth_share * seen->z, 1.5 * seen->scatter)};
  ORBITFUSE_ASSIGN(
      const OtherViews others,
      other_views(source.depth, from_its_side(source.views, view, out.position), out.position,
                  /*looks_past=*/true, progress));
  out.position += others.farther * out.ray;
  out.along = std::max(out.along, others.number < least_others ? unconfirmed_share * seen->z
                                                               : off_weight * others.off);
  out.confirmed = others.number >= least_others;
  return out;
}

Result<Located> located(const SurfaceSource& source, const Eigen::Vector3d& point, double radius,
                        const Progress& progress) {
  std::vector<const PosedView*> order;
  for (const PosedView& view : source.views) order.push_back(&view);
  const auto far = [&](const PosedView* view) {
    return (camera_center(view->cam_from_world) - point).norm();
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](const PosedView* a, const PosedView* b) { return far(a) < far(b); });
  ORBITFUSE_ASSIGN(const OtherViews others,
                   other_views(source.depth, order, point, /*looks_past=*/false, progress));
  // The greater one of those that are known.
  const double off =
      std::fmax(point_share * radius, others.number > 0 ? off_weight * others.off : std::nan(""));
  return Located{point, Eigen::Vector3d::UnitZ(), off, off, others.number >= least_others};
}

}  // namespace orbitfuse::measurement
