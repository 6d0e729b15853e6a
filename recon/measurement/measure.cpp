// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/measure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "core/numeric/percent.hpp"
#include "core/temperature.hpp"
#include "recon/assembly/looked_at.hpp"
#include "recon/measurement/frame_readings.hpp"
#include "recon/measurement/region.hpp"
#include "recon/measurement/surface_samples.hpp"

namespace orbitfuse::measurement {
namespace {

constexpr double default_apart = 0.1;  // of the object's reach

/// Normal and field temperature of a point, from the frames that see it.
Result<SurfacePoint> surface_at_point(const ThermalScene& scene, const Eigen::Vector3d& position,
                                      const Progress& progress) {
  ORBITFUSE_TRY(scene.check_within(position));
  SurfacePoint point;
  point.position = position;
  point.normal.setZero();
  point.field_k = unknown;
  ORBITFUSE_ASSIGN(const PointReadings seen, read_frames(scene, point, {}, progress));
  if (!seen.seen()) return point;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double best_cosine = 0;
  const FrameReading* best = &seen.frames.front();
  for (const FrameReading& reading : seen.frames) {
    ORBITFUSE_ASSIGN(const FieldView view, scene.seen(reading.frame, progress));
    const PosedView& posed = scene.frames()[reading.frame].view;
    const Camera camera = scene.reduced_camera(reading.frame);
    const Eigen::Vector2d in_map = camera.project(posed.cam_from_world * position);
    const int x = std::clamp(static_cast<int>(in_map.x()), 0, view.depth.cols - 1),
              y = std::clamp(static_cast<int>(in_map.y()), 0, view.depth.rows - 1);
    const auto normal = normal_at(view.depth, camera, x, y, normal_reach);
    if (!normal) continue;
    const double cosine = std::abs(normal->dot((posed.cam_from_world * position).normalized()));
    sum += cosine * (posed.cam_from_world.rotation.conjugate() * *normal);
    if (cosine > best_cosine) best_cosine = cosine, best = &reading;
  }
  if (sum.norm() > 1e-6) point.normal = sum.normalized();
  // The field at the point, as the frame that sees it straightest has it.
  const PosedView& posed = scene.frames()[best->frame].view;
  const auto surface = scene.surface_at(posed, best->pixel, progress);
  if (surface) {
    point.field_k = surface->field_k;
    point.variation_k = surface->variation_k;
  }
  return point;
}

void say_unseen(const TemperatureReading& reading, std::vector<std::string>& notes) {
  if (reading.seen()) return;
  notes.push_back(
      fmt::format("no thermal frame sees it{}: there is no measured temperature{}",
                  reading.hidden.empty() ? "" : " (" + reading.hidden + ")",
                  std::isfinite(reading.field_k) ? ", the field's own is a guess" : ""));
}

/// Frames or field that differ by more than "+-" makes one expect, of a spot: a number with a wide
/// "+-" is read as one that is merely rough. Of a region its points differ anyway.
void say_apart(const TemperatureReading& reading, std::vector<std::string>& notes) {
  constexpr double wide = 3;       // times what is assumed for the camera alone
  constexpr double far = 1.5;      // times the uncertainty
  constexpr double decides = 0.9;  // of the weight
  if (reading.points != 1) return;
  double low = HUGE_VAL, high = -HUGE_VAL, most = 0;
  bool two_camps = !reading.outliers.empty();  // is told
  for (const FrameLine& line : reading.frames) {
    two_camps = two_camps && line.used;
    if (!line.used) continue;
    low = std::min(low, line.mean_k);
    high = std::max(high, line.mean_k);
    most = std::max(most, line.weight);
  }
  const bool unsure = reading.uncertainty_k > wide * reading.assumed_k;
  const bool frames_apart = unsure && !two_camps &&
                            std::max(high - reading.temperature_k, reading.temperature_k - low) >
                                far * reading.uncertainty_k;
  const bool field_apart =
      std::abs(reading.field_k - reading.temperature_k) > reading.uncertainty_k;  // NaN: false
  if (!frames_apart && !field_apart && (!unsure || two_camps)) return;
  std::string text;
  if (frames_apart)
    text = fmt::format("its frames are far apart ({:.1f} to {:.1f} C)", celsius_from_kelvin(low),
                       celsius_from_kelvin(high));
  if (field_apart)
    text += fmt::format("{}the field has {:.1f} C, farther off than +- {:.1f}",
                        text.empty() ? "" : ", ", celsius_from_kelvin(reading.field_k),
                        reading.uncertainty_k);
  if (text.empty())
    text = fmt::format(
        "+- {:.1f}{}", reading.uncertainty_k,
        reading.frames.size() > 1 ? fmt::format(", its frames {:.1f} K apart", high - low) : "");
  if (most > decides && reading.frames.size() > 1)
    text += fmt::format(", and one frame decides ({} of the weight)", percent(most));
  notes.push_back(text + ": the place is small, at an edge or seen from the side");
}

/// What stands behind a reading and is less than it seems.
void say_weak(const TemperatureReading& reading, std::vector<std::string>& notes) {
  if (!reading.seen()) return;
  const int unseen = reading.points - reading.seen_points;
  if (unseen > 0)
    notes.push_back(fmt::format("no thermal frame sees {} of {} points ({} of the area)", unseen,
                                reading.points, percent(1 - reading.seen_share)));
  if (!reading.outliers.empty()) notes.push_back(reading.outliers);
  say_apart(reading, notes);
  const auto doubtful = std::count_if(reading.frames.begin(), reading.frames.end(),
                                      [](const FrameLine& line) { return line.doubtful; });
  if (doubtful == static_cast<long>(reading.frames.size()))
    notes.emplace_back("only frames with doubtful poses see it");
  else if (doubtful > 0)
    notes.push_back(fmt::format("{} of {} frames have doubtful poses, {} of the weight", doubtful,
                                reading.frames.size(), percent(reading.doubtful_share())));
}

void say(const TemperatureReading& reading, std::vector<std::string>& notes) {
  say_unseen(reading, notes);
  say_weak(reading, notes);
}

Result<Answer> measure_spot(const ThermalScene& scene, const Request& request,
                            const Reradiometry& radiometry, const Progress& progress) {
  ORBITFUSE_ASSIGN(const SurfacePoint surface, surface_of(scene, request.places[0], progress));
  Answer answer;
  answer.position = surface.position;
  if (!surface.normal.isZero()) answer.normal = surface.normal;
  ORBITFUSE_ASSIGN(answer.reading, read_spot(scene, surface, radiometry, progress));
  say(answer.reading, answer.notes);
  return answer;
}

Result<Answer> measure_points(const ThermalScene& scene, const std::vector<SurfacePoint>& points,
                              const Reradiometry& radiometry, const std::string& nothing,
                              const Progress& progress) {
  Answer answer;
  ORBITFUSE_ASSIGN(answer.reading, read_region(scene, points, radiometry, progress));
  if (points.empty()) {
    answer.reading.hidden = nothing;
  } else {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const SurfacePoint& point : points) sum += point.position;
    answer.position = sum / static_cast<double>(points.size());
  }
  say(answer.reading, answer.notes);
  return answer;
}

/// A camera that sees all places of a line or polygon, and where.
struct CommonView {
  const PosedView* view = nullptr;
  std::vector<Eigen::Vector2d> pixels;
};

/// The view that the places are pixels of; else the thermal frame that sees the one it sees worst
/// best.
Result<CommonView> common_view(const ThermalScene& scene, const Request& request,
                               const Progress& progress) {
  CommonView common;
  std::set<std::string> named;
  for (const Place& place : request.places) {
    const auto* pixel = std::get_if<PixelPlace>(&place);
    named.insert(pixel != nullptr ? pixel->view : "");
    if (pixel != nullptr) common.pixels.push_back(pixel->pixel);
  }
  if (named.size() == 1 && !named.begin()->empty()) {
    ORBITFUSE_ASSIGN(common.view, scene.view(*named.begin()));
    return common;
  }
  struct Seen {
    double weight = HUGE_VAL;
    std::vector<Eigen::Vector2d> pixels;
  };
  std::map<std::size_t, Seen> frames;
  for (std::size_t i = 0; i < request.places.size(); ++i) {
    ORBITFUSE_ASSIGN(const SurfacePoint point, surface_of(scene, request.places[i], progress));
    ORBITFUSE_ASSIGN(const PointReadings readings, read_frames(scene, point, {}, progress));
    for (const FrameReading& r : readings.frames) {
      Seen& seen = frames[r.frame];
      if (seen.pixels.size() != i) continue;  // it missed one before
      seen.weight = std::min(seen.weight, r.weight);
      seen.pixels.push_back(r.pixel);
    }
  }
  double best = 0;
  for (const auto& [frame, seen] : frames)
    if (seen.pixels.size() == request.places.size() && seen.weight > best) {
      best = seen.weight;
      common = {&scene.frames()[frame].view, seen.pixels};
    }
  if (common.view != nullptr) return common;
  const bool line = request.kind == Kind::line;
  return fail(
      ErrorKind::input, std::string(name(request.kind)),
      line ? "no thermal frame sees both of its ends" : "no thermal frame sees all of its corners",
      fmt::format("choose {} on one side of the object, or give {} as pixels of one view",
                  line ? "ends" : "corners", line ? "both" : "all"));
}

Result<Answer> measure_polygon(const ThermalScene& scene, const Request& request,
                               const Reradiometry& radiometry, const Progress& progress) {
  ORBITFUSE_ASSIGN(const CommonView common, common_view(scene, request, progress));
  for (const Eigen::Vector2d& corner : common.pixels)
    ORBITFUSE_TRY(pixel_words(*common.view, corner));
  // Of points the outline may cross itself in a view that its corners were not chosen in.
  if (std::holds_alternative<PixelPlace>(request.places[0]) && crosses_itself(common.pixels))
    return fail(ErrorKind::input, "polygon in " + common.view->name, "its sides cross each other",
                "give its corners in their order round it");
  ORBITFUSE_ASSIGN(const auto points,
                   polygon_samples(scene, *common.view, common.pixels, progress));
  ORBITFUSE_ASSIGN(Answer answer, measure_points(scene, points, radiometry,
                                                 "the field has no surface in it", progress));
  answer.notes.push_back("as seen from " + common.view->name);
  return answer;
}

Result<Answer> measure_line(const ThermalScene& scene, const Request& request,
                            const Reradiometry& radiometry, const Progress& progress) {
  ORBITFUSE_ASSIGN(const CommonView line, common_view(scene, request, progress));
  // Within it a profile is one place, as often as it has points.
  constexpr double shortest_px = 0.5;
  if ((line.pixels[1] - line.pixels[0]).norm() < shortest_px)
    return fail(ErrorKind::input, "line in " + line.view->name, "its two ends are one place there",
                "choose ends that are apart, or measure a spot");
  Answer answer;
  std::vector<SurfacePoint> points;
  double along = 0;
  for (int i = 0; i < request.profile; ++i) {
    ORBITFUSE_TRY(progress.check("measure"));
    const double t = static_cast<double>(i) / (request.profile - 1);
    const auto surface =
        scene.surface_at(*line.view, (1 - t) * line.pixels[0] + t * line.pixels[1], progress);
    if (!surface && surface.error().kind == ErrorKind::cancelled)
      return tl::unexpected(surface.error());
    ProfilePoint point;
    if (surface) {
      if (!points.empty()) along += (surface->position - points.back().position).norm();
      points.push_back(*surface);
      point.at.emplace();
      point.at->position = surface->position;
      point.at->normal = surface->normal;
      ORBITFUSE_ASSIGN(point.at->reading, read_spot(scene, *surface, radiometry, progress));
    }
    point.along = along;
    answer.profile.push_back(std::move(point));
  }
  ORBITFUSE_ASSIGN(answer.reading, read_region(scene, points, radiometry, progress));
  const auto &first = answer.profile.front().at, &last = answer.profile.back().at;
  if (first && last) answer.ends = {first->position, last->position};
  if (points.empty()) answer.reading.hidden = "the field has no surface along it";
  if (const std::size_t holes = answer.profile.size() - points.size(); holes > 0)
    answer.notes.push_back(
        fmt::format("{} of {} points of the line meet no surface", holes, answer.profile.size()));
  answer.notes.push_back("as seen from " + line.view->name);
  say(answer.reading, answer.notes);
  return answer;
}

Result<Answer> measure_extremes(const ThermalScene& scene, const Request& request,
                                const Reradiometry& radiometry, const Progress& progress) {
  ORBITFUSE_ASSIGN(const auto points, object_samples(scene, progress));
  const double apart =
      request.apart > 0 ? request.apart : default_apart * object_radius(*scene.middle());
  Answer answer;
  ORBITFUSE_ASSIGN(answer.spots, extremes(scene, points, request.kind == Kind::hottest,
                                          request.count, apart, radiometry, progress));
  if (answer.spots.size() < static_cast<std::size_t>(request.count))
    answer.notes.push_back(
        fmt::format("{} of {} found: no more places {:.3g} apart that two thermal frames see alike",
                    answer.spots.size(), request.count, apart));
  for (std::size_t i = 0; i < answer.spots.size(); ++i) {
    PlacedReading& spot = answer.spots[i];
    say_weak(spot.reading, spot.notes);
    for (const std::string& note : spot.notes) answer.notes.push_back(place_words(i) + note);
  }
  return answer;
}

/// The temperature that stands for an answer in a difference.
const TemperatureReading& headline(const Answer& answer) {
  return answer.spots.empty() ? answer.reading : answer.spots.front().reading;
}

Result<Answer> measure_difference(const ThermalScene& scene, const Request& request,
                                  const Progress& progress) {
  Answer answer;
  for (const Request& part : request.of) {
    ORBITFUSE_ASSIGN(Answer measured, measure(scene, part, progress));
    answer.of.push_back(std::move(measured));
  }
  const TemperatureReading &a = headline(answer.of[0]), &b = headline(answer.of[1]);
  answer.difference_k = a.temperature_k - b.temperature_k;
  answer.difference_uncertainty_k = std::hypot(a.uncertainty_k, b.uncertainty_k);
  for (std::size_t i = 0; i < 2; ++i)
    if (!headline(answer.of[i]).seen())
      answer.notes.push_back(
          fmt::format("no thermal frame sees the {} of the two: there is no difference",
                      i == 0 ? "first" : "second"));
  if (auto note = parameters_differ(answer.of[0].radiometry, answer.of[1].radiometry))
    answer.notes.push_back(*std::move(note));
  return answer;
}

Result<Located> locate(const ThermalScene& scene, const Place& place, const Progress& progress) {
  if (const auto* point = std::get_if<Eigen::Vector3d>(&place))
    return scene.locate(*point, progress);
  const auto& pixel = std::get<PixelPlace>(place);
  ORBITFUSE_ASSIGN(const PosedView* view, scene.view(pixel.view));
  return scene.locate(*view, pixel.pixel, progress);
}

Result<Answer> measure_distance(const ThermalScene& scene, const Request& request,
                                const Progress& progress) {
  Answer answer;
  ORBITFUSE_ASSIGN(const Located a, locate(scene, request.places[0], progress));
  ORBITFUSE_ASSIGN(const Located b, locate(scene, request.places[1], progress));
  for (const auto& [place, found] :
       {std::pair(&request.places[0], &a), std::pair(&request.places[1], &b)}) {
    const std::string end = place == &request.places[0] ? "its first end" : "its second end";
    if (!found->confirmed)
      answer.notes.push_back("fewer than two other views show a surface at " + end);
    if (const auto* pixel = std::get_if<PixelPlace>(place);
        pixel != nullptr && scene.is_doubtful(pixel->view))
      answer.notes.push_back(
          fmt::format("{} is a pixel of {}, whose pose is in doubt: it may be another place", end,
                      pixel->view));
  }
  const Apart between = apart(a, b);
  answer.distance = between.length;
  answer.distance_uncertainty = sigmas_of_90_percent * between.sigma;
  answer.ends = {a.position, b.position};
  answer.position = 0.5 * (a.position + b.position);
  if (scene.metres_per_unit()) {
    answer.distance_m = answer.distance * *scene.metres_per_unit();
    answer.distance_uncertainty_m =
        distance_uncertainty_m(answer.distance, answer.distance_uncertainty,
                               *scene.metres_per_unit(), scene.scale_relative_sigma());
  } else
    answer.notes.emplace_back(no_scale_note);
  return answer;
}

Result<Answer> dispatch(const ThermalScene& scene, const Request& request,
                        const Reradiometry& radiometry, const Progress& progress) {
  switch (request.kind) {
    case Kind::spot:
      return measure_spot(scene, request, radiometry, progress);
    case Kind::box: {
      ORBITFUSE_ASSIGN(const auto points, box_samples(scene, request.box, progress));
      return measure_points(scene, points, radiometry, "no surface that one sees lies in it",
                            progress);
    }
    case Kind::polygon:
      return measure_polygon(scene, request, radiometry, progress);
    case Kind::line:
      return measure_line(scene, request, radiometry, progress);
    case Kind::hottest:
    case Kind::coldest:
      return measure_extremes(scene, request, radiometry, progress);
    case Kind::difference:
      return measure_difference(scene, request, progress);
    case Kind::distance:
      break;
  }
  return measure_distance(scene, request, progress);
}

}  // namespace

Request anchored(Request request, const Answer& answer) {
  for (std::size_t i = 0; i < std::min(request.of.size(), answer.of.size()); ++i)
    request.of[i] = anchored(std::move(request.of[i]), answer.of[i]);
  // What is a point already stays one: asked again and again, it must not wander.
  const auto anchor = [&](std::size_t i, const Eigen::Vector3d& point) {
    if (i < request.places.size() && std::holds_alternative<PixelPlace>(request.places[i]))
      request.places[i] = point;
  };
  if (request.kind == Kind::spot && answer.position) anchor(0, *answer.position);
  for (std::size_t i = 0; i < answer.ends.size(); ++i) anchor(i, answer.ends[i]);
  return request;
}

Result<SurfacePoint> surface_of(const ThermalScene& scene, const Place& place,
                                const Progress& progress) {
  if (const auto* point = std::get_if<Eigen::Vector3d>(&place))
    return surface_at_point(scene, *point, progress);
  const auto& pixel = std::get<PixelPlace>(place);
  ORBITFUSE_ASSIGN(const PosedView* view, scene.view(pixel.view));
  return scene.surface_at(*view, pixel.pixel, progress);
}

Result<Answer> measure(const ThermalScene& scene, const Request& request,
                       const Progress& progress) {
  ORBITFUSE_TRY(request.validate());
  ORBITFUSE_ASSIGN(const Reradiometry radiometry,
                   Reradiometry::make(scene.frames(), request.object, request.recorded));
  ORBITFUSE_ASSIGN(Answer answer, dispatch(scene, request, radiometry, progress));
  answer.kind = request.kind;
  if (!radiometry.assumption().empty()) answer.notes.push_back(radiometry.assumption());
  if (request.kind != Kind::difference && request.kind != Kind::distance)
    answer.radiometry = used_parameters(scene.frames(), request.object, request.recorded);
  return answer;
}

namespace {

bool is_pixel_spot(const Request& request) {
  return request.kind == Kind::spot && std::holds_alternative<PixelPlace>(request.places[0]);
}

/// With the spots of what is kept; a line's points may be seen best from another view than the one
/// that it was drawn in. Nothing where no spot was a pixel.
std::optional<Request> with_kept_spots(const Request& request, const Request& kept) {
  if (is_pixel_spot(request)) return kept;
  std::optional<Request> changed;
  for (std::size_t i = 0; i < request.of.size(); ++i)
    if (auto part = with_kept_spots(request.of[i], kept.of[i])) {
      if (!changed) changed = request;
      changed->of[i] = *std::move(part);
    }
  return changed;
}

}  // namespace

Result<Anchored> measure_anchored(const ThermalScene& scene, const Request& request,
                                  const Progress& progress) {
  ORBITFUSE_ASSIGN(Answer answer, measure(scene, request, progress));
  Request kept = anchored(request, answer);
  if (const auto again = with_kept_spots(request, kept)) {
    Result<Answer> answered = measure(scene, *again, progress);
    // What a far wall's pixel shows may lie beyond where points are taken for the scene's.
    if (answered || answered.error().kind == ErrorKind::cancelled) {
      ORBITFUSE_ASSIGN(answer, std::move(answered));
    }
  }
  return Anchored{std::move(kept), std::move(answer)};
}

}  // namespace orbitfuse::measurement
