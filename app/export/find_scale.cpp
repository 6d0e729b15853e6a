// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/find_scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <optional>

#include "core/geometry/scene_ball.hpp"
#include "core/numeric/median.hpp"
#include "recon/measurement/field_source.hpp"
#include "recon/measurement/located.hpp"

namespace orbitfuse::exporting {
namespace {
using measurement::PixelPlace;
using measurement::Place;
using stages::MetricScale;

/// Where the run's surface lies: of its visible field, while it has one.
measurement::SurfaceSource surface_of(const view::FinishedRun& run) {
  const Modality seen = run.has(Modality::visible) ? Modality::visible : Modality::thermal;
  const bool visible = seen == Modality::visible;
  // The run outlives what is asked of it here.
  const std::shared_ptr<const nerf::Field> field(std::shared_ptr<void>(),
                                                 visible ? &run.visible : &run.thermal);
  measurement::SurfaceSource source{
      measurement::surface_renderer(field, visible ? Similarity3d() : run.frame_from_thermal), {}};
  for (const view::RecordedView& v : run.views)
    if (v.modality == seen && !v.doubt) source.views.push_back(v.view);
  return source;
}

Error of_usage(Error error) {
  if (error.kind != ErrorKind::input) return error;
  error.kind = ErrorKind::usage;
  error.where = "--distance: " + error.where;
  return error;
}

/// The command line's place: what is wrong with it is a matter of usage.
Result<measurement::Located> pointed(const view::FinishedRun& run,
                                     const measurement::SurfaceSource& surface, const Place& place,
                                     const Progress& progress) {
  if (const auto* point = std::get_if<Eigen::Vector3d>(&place)) {
    ORBITFUSE_TRY(measurement::check_in_scene(*point, run.center, run.radius).map_error(of_usage));
    return measurement::located(surface, *point, run.radius, progress);
  }
  const auto& pixel = std::get<PixelPlace>(place);
  const auto found = std::find_if(run.views.begin(), run.views.end(),
                                  [&](const auto& v) { return v.view.name == pixel.view; });
  if (found == run.views.end())
    return fail(ErrorKind::usage, "--distance", "'" + pixel.view + "', which is no posed view",
                "name one as the session does, e.g. " +
                    (run.views.empty() ? "visible/000000.jpg" : run.views.front().view.name));
  return measurement::located(surface, found->view, pixel.pixel, progress).map_error(of_usage);
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
  const measurement::SurfaceSource surface = surface_of(run);
  ORBITFUSE_ASSIGN(const measurement::Located a, pointed(run, surface, from, progress));
  ORBITFUSE_ASSIGN(const measurement::Located b, pointed(run, surface, to, progress));
  const auto [length, sigma] = measurement::apart(a, b);
  if (!(length > 1e-6 * run.radius))
    return fail(ErrorKind::usage, "--distance", "two places that are one",
                "choose places that are far apart");
  MetricScale scale;
  scale.metres_per_unit = metres / length;
  scale.relative_uncertainty = sigma / length;
  scale.source = "one distance";
  scale.how = fmt::format("{:.4f} units are {:.4f} m", length, metres);
  for (const auto& [place, found] : {std::pair(&from, &a), std::pair(&to, &b)})
    if (std::holds_alternative<Eigen::Vector3d>(*place))
      scale.how += fmt::format("; a typed point counts as {:.4f} units off", found->across);
  for (const view::RecordedView& v : run.views)
    for (const Place* place : {&from, &to})
      if (const auto* pixel = std::get_if<PixelPlace>(place);
          pixel != nullptr && pixel->view == v.view.name && v.doubt)
        scale.how += "; the pose of " + pixel->view + " is in doubt";
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
