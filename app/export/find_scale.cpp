// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/find_scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/geometry/lens_fold.hpp"
#include "core/geometry/scene_ball.hpp"
#include "core/numeric/median.hpp"
#include "recon/assembly/field_surface.hpp"
#include "recon/assembly/looked_at.hpp"

namespace orbitfuse::exporting {
namespace {
using measurement::PixelPlace;
using measurement::Place;
using stages::MetricScale;

/// A place and how far off it may be (one standard deviation): across the ray and along it.
struct Pointed {
  Eigen::Vector3d position, ray;
  double across = 0, along = 0;

  double variance_along(const Eigen::Vector3d& direction) const {
    const double part = direction.dot(ray);
    return across * across * (1 - part * part) + along * along * part * part;
  }
};

constexpr double pointing_px = 1;      // how well a pixel is pointed at
constexpr double depth_share = 0.003;  // of a field's depth at its best (docs/benchmarks/export.md)
constexpr double off_weight = 1.5;     // of what other views' depths are off by
constexpr double unconfirmed_share = 0.03;  // of a depth that too few other views see
constexpr double point_share = 0.002;       // of the orbit's radius: what a typed point may be off

/// The field's depth where a view's ray goes, in the frame's unit, and how much it varies from
/// pixel to pixel; nothing where too few pixels have one.
struct SeenDepth {
  double z = 0, scatter = 0;
  Eigen::Vector3d ray;  ///< in the camera, z = 1
  double fx = 0;
};
Result<std::optional<SeenDepth>> depth_at(const view::FinishedRun& run, const PosedView& view,
                                          const Eigen::Vector2d& normalized,
                                          const Progress& progress) {
  // A picture of a few pixels round the place is all that has to be rendered.
  // As many as the camera's focal length needs for a picture that a lens could have taken.
  Camera small = view.camera.without_distortion();
  const int half = std::max(2, static_cast<int>(small.fx / 200)), side = 2 * half + 1;
  small.width = small.height = side;
  small.cx = side / 2.0 - small.fx * normalized.x();
  small.cy = side / 2.0 - small.fy * normalized.y();
  const bool visible = run.has(Modality::visible);
  nerf::RenderOptions how;
  how.surface_light = FieldSurfaceOptions().surface_light;  // on the surface that is exported
  const Similarity3d field_from_frame = visible ? Similarity3d() : run.frame_from_thermal.inverse();
  ORBITFUSE_ASSIGN(const nerf::RenderedView seen,
                   nerf::render(visible ? run.visible : run.thermal, small,
                                rebase(view.cam_from_world, field_from_frame), how, progress));
  std::vector<double> depths;
  for (int y = half - 1; y <= half + 1; ++y)
    for (int x = half - 1; x <= half + 1; ++x)
      if (const float z = seen.depth.at<float>(y, x);
          std::isfinite(z) && seen.opacity.at<float>(y, x) >= FieldSurfaceOptions().min_opacity)
        depths.push_back(static_cast<double>(z) / field_from_frame.scale);
  if (depths.size() < 5) return std::nullopt;
  SeenDepth found;
  found.z = median(depths);
  for (double& d : depths) d = std::abs(d - found.z);
  found.scatter = median(depths);
  found.ray = small.ray_of({side / 2.0, side / 2.0});
  found.fx = small.fx;
  return found;
}

/// What other recorded views' depths say of a point of the surface, nearest views first: where
/// a field puts glass, gloss or plain paint at another depth from each side, one view alone does
/// not tell.
struct OtherViews {
  double farther = 0;      ///< along the ray, middle of all views, the point's own among them
  double off = 0;          ///< three quarters of them are off by no more
  std::size_t number = 0;  ///< that see it
};
Result<OtherViews> other_views(const view::FinishedRun& run, const view::RecordedView& self,
                               const Eigen::Vector3d& point, const Progress& progress) {
  constexpr double most_turn_deg = 80, hidden_share = 0.1;
  constexpr std::size_t enough = 12;
  const Eigen::Vector3d from = (camera_center(self.view.cam_from_world) - point).normalized();
  std::vector<std::pair<double, const view::RecordedView*>> others;
  for (const view::RecordedView& v : run.views) {
    if (&v == &self || v.doubt || v.modality != self.modality) continue;
    const double turn = (camera_center(v.view.cam_from_world) - point).normalized().dot(from);
    if (turn > std::cos(most_turn_deg * std::numbers::pi / 180)) others.emplace_back(-turn, &v);
  }
  std::sort(others.begin(), others.end());
  std::vector<double> farther{0}, off;
  for (const auto& [turn, v] : others) {
    if (off.size() >= enough) break;
    const Eigen::Vector3d in_cam = v->view.cam_from_world * point;
    const Eigen::Vector2d pixel = v->view.camera.project(in_cam);
    if (!(in_cam.z() > 0 && lens_holds(v->view.camera, in_cam) && pixel.x() >= 0 &&
          pixel.y() >= 0 && pixel.x() < v->view.camera.width && pixel.y() < v->view.camera.height))
      continue;
    ORBITFUSE_ASSIGN(const auto seen,
                     depth_at(run, v->view, in_cam.head<2>() / in_cam.z(), progress));
    if (!seen || seen->z < in_cam.z() * (1 - hidden_share)) continue;
    farther.push_back(seen->z - in_cam.z());
    off.push_back(std::abs(farther.back()));
  }
  if (off.empty()) return OtherViews{};
  std::sort(off.begin(), off.end());
  return OtherViews{median(farther), off[off.size() * 3 / 4], off.size()};
}

Result<Pointed> pointed_pixel(const view::FinishedRun& run, const PixelPlace& place,
                              const Progress& progress) {
  const auto found = std::find_if(run.views.begin(), run.views.end(),
                                  [&](const auto& v) { return v.view.name == place.view; });
  if (found == run.views.end())
    return fail(ErrorKind::usage, "--distance", "'" + place.view + "', which is no posed view",
                "name one as the session does, e.g. " +
                    (run.views.empty() ? "visible/000000.jpg" : run.views.front().view.name));
  const Camera& camera = found->view.camera;
  const auto& [u, v] = std::pair(place.pixel.x(), place.pixel.y());
  if (!(u >= 0 && v >= 0 && u <= camera.width && v <= camera.height))
    return fail(
        ErrorKind::usage, "--distance",
        fmt::format("{},{} in {}, of {}x{} pixels", u, v, place.view, camera.width, camera.height),
        "choose a pixel of the view");
  const Eigen::Vector2d at = camera.normalized_of(place.pixel);
  if (!at.allFinite())
    return fail(ErrorKind::usage, "--distance", "a pixel beyond where the lens is known",
                "choose one nearer to the middle");
  ORBITFUSE_ASSIGN(const auto seen, depth_at(run, found->view, at, progress));
  if (!seen)
    return fail(ErrorKind::usage, "--distance",
                fmt::format("{},{},{} shows nothing that the run knows", place.view, u, v),
                "choose a pixel on the object");
  const Rigid3d world_from_cam = found->view.cam_from_world.inverse();
  Pointed out{world_from_cam * (seen->z * seen->ray),
              world_from_cam.rotation * seen->ray.normalized(), pointing_px * seen->z / seen->fx,
              std::max(depth_share * seen->z, 1.5 * seen->scatter)};
  ORBITFUSE_ASSIGN(const OtherViews others, other_views(run, *found, out.position, progress));
  out.position += others.farther * out.ray;
  constexpr std::size_t least_others = 2;
  out.along = std::max(out.along, others.number < least_others ? unconfirmed_share * seen->z
                                                               : off_weight * others.off);
  return out;
}

Result<Pointed> pointed(const view::FinishedRun& run, const Place& place,
                        const Progress& progress) {
  if (const auto* pixel = std::get_if<PixelPlace>(&place))
    return pointed_pixel(run, *pixel, progress);
  const Eigen::Vector3d& point = std::get<Eigen::Vector3d>(place);
  if (!point.allFinite())
    return fail(ErrorKind::usage, "--distance", "a point that is not finite", "write X,Y,Z");
  if (const double off = (point - run.center).norm(); !(off <= surroundings_reach * run.radius))
    return fail(ErrorKind::usage, "--distance",
                fmt::format("a point outside of the scene: {:.3g} from its middle, the cameras "
                            "stand {:.3g} from it",
                            off, run.radius),
                "give coordinates of this run's world, or pixels of recorded views");
  const double off = point_share * run.radius;
  return Pointed{point, Eigen::Vector3d::UnitZ(), off, off};
}

double residual(const Similarity3d& metres_from_world, const PosePair& pair) {
  return (metres_from_world * camera_center(pair.cam_from_estimate) -
          camera_center(pair.cam_from_truth))
      .norm();
}

}  // namespace

Result<double> metres_of(const std::string& option, const std::string& words) {
  double value = 0;
  const char* const end = words.data() + words.size();
  const auto [stop, error] = std::from_chars(words.data(), end, value);
  const std::string unit(stop, end);
  const double metres = unit == "m" ? 1 : unit == "cm" ? 0.01 : unit == "mm" ? 0.001 : 0;
  constexpr const char* form = "write a length with its unit, e.g. 1.20m, 35cm or 350mm";
  if (error != std::errc() || metres == 0)
    return fail(ErrorKind::usage, option, "'" + words + "'", form);
  if (!(value * metres >= 1e-4 && value * metres <= 1e4))
    return fail(ErrorKind::usage, option, "'" + words + "'", "choose 0.1 mm to 10 km");
  return value * metres;
}

Result<MetricScale> scale_of_distance(const view::FinishedRun& run, const Place& from,
                                      const Place& to, double metres, const Progress& progress) {
  ORBITFUSE_ASSIGN(const Pointed a, pointed(run, from, progress));
  ORBITFUSE_ASSIGN(const Pointed b, pointed(run, to, progress));
  const Eigen::Vector3d apart = b.position - a.position;
  const double length = apart.norm();
  if (!(length > 1e-6 * run.radius))
    return fail(ErrorKind::usage, "--distance", "two places that are one",
                "choose places that are far apart");
  const Eigen::Vector3d direction = apart / length;
  MetricScale scale;
  scale.metres_per_unit = metres / length;
  scale.relative_uncertainty =
      std::sqrt(a.variance_along(direction) + b.variance_along(direction)) / length;
  scale.source = "one distance";
  scale.how = fmt::format("{:.4f} units are {:.4f} m", length, metres);
  if (std::holds_alternative<Eigen::Vector3d>(from) || std::holds_alternative<Eigen::Vector3d>(to))
    scale.how +=
        fmt::format("; a typed point counts as {:.4f} units off", point_share * run.radius);
  ORBITFUSE_TRY(scale.validate("--distance"));
  return scale;
}

Result<MetricScale> scale_of_cameras(std::vector<PosePair> pairs, const std::string& source,
                                     double place_error_m) {
  ORBITFUSE_ASSIGN(Similarity3d fit, truth_from_estimate(pairs));
  // One wrong camera must not decide: those far off the others' middle are left out once.
  std::vector<double> off;
  for (const PosePair& pair : pairs) off.push_back(residual(fit, pair));
  const double most = std::max(4 * median(off), 1e-9);
  std::vector<PosePair> kept;
  for (const PosePair& pair : pairs)
    if (residual(fit, pair) <= most) kept.push_back(pair);
  if (kept.size() >= 3 && kept.size() < pairs.size()) {
    ORBITFUSE_ASSIGN(fit, truth_from_estimate(kept));
    pairs = std::move(kept);
  }
  const auto count = static_cast<double>(pairs.size());
  std::vector<Eigen::Vector3d> centers;
  double squares = 0;
  for (const PosePair& pair : pairs) {
    squares += std::pow(residual(fit, pair), 2);
    centers.push_back(camera_center(pair.cam_from_truth));
  }
  const double radius = rms_radius(centers), spread = count * radius * radius;
  const double freedom = std::max(1.0, 3.0 * count - 7);
  const double rms = std::sqrt(squares / count);
  if (rms > 0.1 * radius)
    return fail(ErrorKind::input, source,
                fmt::format("its cameras are {:.3f} m off the run's", rms),
                "see whether both are of this session, and doubtful poses in the report");
  const double variance = std::max(squares / freedom, place_error_m * place_error_m);
  MetricScale scale{fit.scale, std::sqrt(variance / spread), source,
                    fmt::format("{} cameras, {:.4f} m off", pairs.size(), rms)};
  ORBITFUSE_TRY(scale.validate(source));
  return scale;
}

Result<MetricScale> scale_of_known_poses(const view::FinishedRun& run,
                                         std::optional<double> place_error_m) {
  if (!run.session)
    return fail(ErrorKind::input, "known poses", "the session is not where the run read it",
                "bring it back");
  std::vector<PosePair> pairs;
  for (const view::RecordedView& v : run.views)
    for (const FrameRecord& frame : run.session->frames)
      if (frame.file == v.view.name && frame.cam_from_world)
        pairs.push_back({v.view.cam_from_world, *frame.cam_from_world, v.view.name});
  if (pairs.size() < 3)
    return fail(ErrorKind::input, "known poses",
                fmt::format("{} of the session's frames have one", pairs.size()),
                "import them with their poses, or tell one distance: --distance");
  ORBITFUSE_ASSIGN(MetricScale scale,
                   scale_of_cameras(std::move(pairs), "known poses", place_error_m.value_or(0)));
  constexpr double rounding = 1e-7;
  if (!place_error_m && scale.relative_uncertainty < rounding)
    return fail(ErrorKind::usage, "--known-poses",
                "the run took them as they are, so that nothing shows how exact they are",
                "say how far off a camera's place may be: --pose-error 5mm");
  return scale;
}

}  // namespace orbitfuse::exporting
