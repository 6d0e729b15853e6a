// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/region.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "core/system/parallel.hpp"
#include "core/temperature.hpp"
#include "recon/measurement/estimate.hpp"

namespace orbitfuse::measurement {
namespace {

/// Coldest places are looked for where that is sure: at the object's rim frames mix it with the
/// sky.
constexpr double certainty = 2;
constexpr int points_per_block = 256;
/// Read together: each holds every frame's reading.
constexpr std::size_t points_at_once = 4096;

/// A point's estimate, and which of its frames it is of.
struct Settled {
  Estimate estimate;
  Agreement agreement;
  std::string outliers;  ///< TemperatureReading::outliers
};

std::string span_of(double low_k, double high_k) {
  const double low = celsius_from_kelvin(low_k), high = celsius_from_kelvin(high_k);
  return high - low < 0.1 ? fmt::format("{:.1f} C", 0.5 * (low + high))
                          : fmt::format("{:.1f} to {:.1f} C", low, high);
}

std::string outliers_of(const PointReadings& readings, const Agreement& agreement) {
  if (agreement.all_near()) return {};
  double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
  std::vector<std::pair<double, double>> kept;
  int far = 0;
  for (std::size_t i = 0; i < readings.frames.size(); ++i) {
    const std::size_t near = agreement.near[i] ? 1 : 0;
    low[near] = std::min(low[near], readings.frames[i].temperature_k);
    high[near] = std::max(high[near], readings.frames[i].temperature_k);
    far += near == 0;
    if (near == 1) kept.emplace_back(readings.frames[i].temperature_k, readings.frames[i].weight);
  }
  const std::string text = fmt::format(
      "{} of {} frames {}: {} against ", far, readings.frames.size(),
      agreement.two_camps ? "contradict the others" : "left out", span_of(low[0], high[0]));
  if (kept.empty() || low[1] > high[0] || high[1] < low[0]) return text + span_of(low[1], high[1]);
  // Both spans would read as a contradiction.
  const double middle = weighted_median(kept);
  double counted = 0, least = HUGE_VAL;  // kelvin from there
  for (std::size_t i = 0; i < readings.frames.size(); ++i) {
    const double off = std::abs(readings.frames[i].temperature_k - middle);
    if (agreement.near[i])
      counted = std::max(counted, off);
    else
      least = std::min(least, off);
  }
  return text + fmt::format("{:.1f} C in the middle of the others{}", celsius_from_kelvin(middle),
                            counted >= least && !agreement.two_camps
                                ? "; such as are as far off and count see an edge there, and show "
                                  "either side of it"
                                : "");
}

/// Marks the frames that are left out and takes their weight. There is a reading.
Settled settle(PointReadings& readings, double field_k, double variation_k,
               const MeasurementOptions& options) {
  std::vector<WeightedReading> list;
  for (const FrameReading& r : readings.frames)
    list.push_back({r.temperature_k, r.gradient_k_per_px, r.weight});
  Settled result;
  result.agreement = agreement_of(list, options);
  result.outliers = outliers_of(readings, result.agreement);
  double sum = 0, gain = 0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    FrameReading& r = readings.frames[i];
    r.used = result.agreement.uses(i);
    if (!r.used) r.weight = 0;
    sum += r.weight;
  }
  for (FrameReading& r : readings.frames) r.weight /= sum, gain += r.weight * r.gain;
  result.estimate = estimate(list, result.agreement, {field_k, gain * variation_k, gain}, options);
  return result;
}

double weighted_angle(const std::vector<FrameLine>& frames) {
  double sum = 0, weight = 0;
  for (const FrameLine& line : frames) sum += line.weight * line.angle_deg, weight += line.weight;
  return sum / weight;
}

/// Calls `use` with every point's readings, one after the other. The frames' images and depth maps
/// are made first: workers that waited for each other's would stand still.
Status read_all(const ThermalScene& scene, const std::vector<SurfacePoint>& points,
                const Reradiometry& radiometry, const Progress& progress,
                const std::function<void(std::size_t, PointReadings&)>& use) {
  for (std::size_t i = 0; i < scene.frames().size(); ++i) {
    ORBITFUSE_TRY(scene.seen(i, progress));
    ORBITFUSE_TRY(scene.image(i));
  }
  for (std::size_t first = 0; first < points.size(); first += points_at_once) {
    const std::size_t count = std::min(points_at_once, points.size() - first);
    std::vector<PointReadings> readings(count);
    std::vector<Status> problems(count);
    parallel_blocks(static_cast<int>(count), points_per_block, [&](int begin, int end) {
      if (progress.cancelled()) return;
      for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
        auto read = read_frames(scene, points[first + i], radiometry, progress);
        if (read)
          readings[i] = *std::move(read);
        else
          problems[i] = tl::unexpected(read.error());
      }
    });
    ORBITFUSE_TRY(progress.check("measure"));
    for (const Status& problem : problems) ORBITFUSE_TRY(problem);
    for (std::size_t i = 0; i < count; ++i) use(first + i, readings[i]);
  }
  return {};
}

/// What one frame saw of a region.
struct FrameSum {
  double area = 0, temperature = 0, angle = 0, fineness = 0;  // of all points that it sees
  double used_area = 0, offset = 0, gradient2 = 0, weight = 0, gain = 0;  // of those it counts in
  double min_k = std::numeric_limits<double>::infinity(), max_k = -min_k;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();

  void add(const FrameReading& r, double point_k, double point_area) {
    area += point_area;
    temperature += point_area * r.temperature_k;
    angle += point_area * r.angle_deg;
    fineness += point_area * r.pixels_per_unit;
    pixel += point_area * r.pixel;
    min_k = std::min(min_k, r.temperature_k);
    max_k = std::max(max_k, r.temperature_k);
    if (!r.used) return;
    used_area += point_area;
    offset += point_area * (r.temperature_k - point_k);
    gradient2 += point_area * r.gradient_k_per_px * r.gradient_k_per_px;
    weight += point_area * r.weight;
    gain += point_area * r.weight * r.gain;
  }
};

/// Statistics over a region's points.
struct PointSum {
  double area = 0, sum = 0, squares = 0;
  double min_k = std::numeric_limits<double>::infinity(), max_k = -min_k;

  void add(double kelvin, double point_area, double reference_k) {
    const double t = kelvin - reference_k;  // squares of kelvin would lose the digits that differ
    area += point_area;
    sum += point_area * t;
    squares += point_area * t * t;
    min_k = std::min(min_k, kelvin);
    max_k = std::max(max_k, kelvin);
  }
  void tell(double reference_k, TemperatureReading& reading) const {
    const double mean = sum / area;
    reading.mean_k = reference_k + mean;
    reading.min_k = min_k;
    reading.max_k = max_k;
    reading.standard_deviation_k = std::sqrt(std::max(0.0, squares / area - mean * mean));
  }
};

void tell_unsure(const Estimate& estimate, TemperatureReading& reading) {
  reading.uncertainty_k = estimate.uncertainty_k;
  reading.assumed_k = estimate.assumed_k;
  reading.spread_k = estimate.spread_k;
}

FrameLine line_of(const ThermalScene& scene, std::size_t frame, const FrameSum& s, double all_area,
                  double all_weight) {
  const ThermalFrame& of = scene.frames()[frame];
  return {.frame = of.view.name,
          .pixel = s.pixel / s.area,
          .mean_k = s.temperature / s.area,
          .min_k = s.min_k,
          .max_k = s.max_k,
          .angle_deg = s.angle / s.area,
          .pixels_per_unit = s.fineness / s.area,
          .weight = s.weight / all_weight,
          .used = s.used_area > 0,
          .covered = s.area / all_area,
          .doubtful = of.doubtful()};
}

}  // namespace

Result<TemperatureReading> read_spot(const ThermalScene& scene, const SurfacePoint& surface,
                                     const Reradiometry& radiometry, const Progress& progress) {
  ORBITFUSE_ASSIGN(PointReadings readings, read_frames(scene, surface, radiometry, progress));
  TemperatureReading result;
  result.field_k = radiometry.field_k(surface.field_k);
  result.hidden = readings.why_hidden();
  if (!readings.seen()) return result;
  const Settled settled = settle(readings, result.field_k, surface.variation_k, scene.options());
  const Estimate& e = settled.estimate;
  result.seen_points = 1;
  result.seen_share = 1;
  result.outliers = settled.outliers;
  result.temperature_k = e.temperature_k;
  tell_unsure(e, result);
  PointSum sum;
  for (const FrameReading& r : readings.frames) {
    sum.add(r.temperature_k, 1, e.temperature_k);
    result.frames.push_back({.frame = scene.frames()[r.frame].view.name,
                             .pixel = r.pixel,
                             .mean_k = r.temperature_k,
                             .min_k = r.temperature_k,
                             .max_k = r.temperature_k,
                             .angle_deg = r.angle_deg,
                             .pixels_per_unit = r.pixels_per_unit,
                             .weight = r.weight,
                             .used = r.used,
                             .doubtful = scene.frames()[r.frame].doubtful()});
  }
  sum.tell(e.temperature_k, result);
  result.angle_deg = weighted_angle(result.frames);
  return result;
}

namespace {

/// What adds up over a region's points.
struct RegionSum {
  std::map<std::size_t, FrameSum> frames;
  PointSum seen, field, seen_field;
  double reference_k = unknown, all_area = 0, two_camps_area = 0;
  int seen_points = 0, left_out = 0, two_camps = 0;  // points
  std::array<int, hidden_kinds> hidden{};

  void add(const SurfacePoint& point, double field_k, PointReadings& readings,
           const MeasurementOptions& options) {
    const double area = point.weight;
    all_area += area;
    if (std::isfinite(field_k)) field.add(field_k, area, 0);
    for (std::size_t k = 0; k < hidden_kinds; ++k) hidden[k] += readings.hidden[k];
    if (!readings.seen()) return;
    ++seen_points;
    if (std::isfinite(field_k)) seen_field.add(field_k, area, 0);
    const Settled settled = settle(readings, field_k, 0, options);
    const double point_k = settled.estimate.temperature_k;
    if (settled.agreement.two_camps) {
      ++two_camps;
      two_camps_area += area;
    } else if (!settled.outliers.empty()) {
      ++left_out;
    }
    if (std::isnan(reference_k)) reference_k = point_k;
    seen.add(point_k, area, reference_k);
    for (const FrameReading& r : readings.frames) frames[r.frame].add(r, point_k, area);
  }
  std::string outliers() const {
    std::string text;
    if (left_out > 0) text = fmt::format("frames left out at {} points", left_out);
    if (two_camps > 0)
      text += fmt::format("{}frames contradict each other at {} points", text.empty() ? "" : ", ",
                          two_camps);
    return text.empty() ? text : text + fmt::format(" of {}", seen_points);
  }
};

/// Of the points together, from what each frame is off them: the mean holds all of those frames.
Estimate region_estimate(const RegionSum& sum, double mean_k, double all_weight,
                         const MeasurementOptions& options) {
  std::vector<WeightedReading> offsets;
  double gain = 0;
  for (const auto& [frame, s] : sum.frames) {
    if (!(s.used_area > 0)) continue;
    gain += s.gain / all_weight;
    offsets.push_back({mean_k + s.offset / s.used_area, std::sqrt(s.gradient2 / s.used_area),
                       s.weight / all_weight});
  }
  Agreement all;
  all.near.assign(offsets.size(), true);
  all.two_camps = sum.two_camps_area > 0.25 * sum.seen.area;
  const PointSum& field = sum.seen_field;
  return estimate(offsets, all, {field.area > 0 ? field.sum / field.area : unknown, 0, gain},
                  options);
}

}  // namespace

Result<TemperatureReading> read_region(const ThermalScene& scene,
                                       const std::vector<SurfacePoint>& points,
                                       const Reradiometry& radiometry, const Progress& progress) {
  RegionSum sum;
  ORBITFUSE_TRY(
      read_all(scene, points, radiometry, progress, [&](std::size_t i, PointReadings& readings) {
        sum.add(points[i], radiometry.field_k(points[i].field_k), readings, scene.options());
      }));
  TemperatureReading result;
  result.points = static_cast<int>(points.size());
  result.seen_points = sum.seen_points;
  if (sum.field.area > 0) result.field_k = sum.field.sum / sum.field.area;
  // As many frames as a point has in the mean.
  const auto count = static_cast<int>(std::max<std::size_t>(1, points.size()));
  for (int& frames : sum.hidden) frames = (frames + count - 1) / count;
  result.hidden = PointReadings{{}, sum.hidden}.why_hidden();
  if (sum.frames.empty()) return result;
  result.seen_share = sum.seen.area / sum.all_area;
  sum.seen.tell(sum.reference_k, result);
  double all_weight = 0;
  for (const auto& [frame, s] : sum.frames) all_weight += s.weight;
  for (const auto& [frame, s] : sum.frames)
    result.frames.push_back(line_of(scene, frame, s, sum.all_area, all_weight));
  tell_unsure(region_estimate(sum, result.mean_k, all_weight, scene.options()), result);
  result.temperature_k = result.mean_k;
  result.outliers = sum.outliers();
  result.angle_deg = weighted_angle(result.frames);
  return result;
}

Result<std::vector<PointTemperature>> read_points(const ThermalScene& scene,
                                                  const std::vector<SurfacePoint>& points,
                                                  const Reradiometry& radiometry,
                                                  const Progress& progress) {
  std::vector<PointTemperature> result(points.size());
  ORBITFUSE_TRY(
      read_all(scene, points, radiometry, progress, [&](std::size_t i, PointReadings& readings) {
        if (!readings.seen()) return;
        const int frames = static_cast<int>(readings.frames.size());
        const Settled settled = settle(readings, radiometry.field_k(points[i].field_k),
                                       points[i].variation_k, scene.options());
        result[i] = {settled.estimate.temperature_k, settled.estimate.uncertainty_k, frames,
                     settled.agreement.two_camps};
      }));
  return result;
}

Result<std::vector<PlacedReading>> extremes(const ThermalScene& scene,
                                            const std::vector<SurfacePoint>& points, bool hottest,
                                            int count, double apart, const Reradiometry& radiometry,
                                            const Progress& progress) {
  const std::size_t enough = std::min<std::size_t>(2, scene.frames().size());
  std::vector<std::pair<double, std::size_t>> order;
  ORBITFUSE_TRY(
      read_all(scene, points, radiometry, progress, [&](std::size_t i, PointReadings& readings) {
        if (readings.frames.size() < enough) return;
        const Settled settled = settle(readings, radiometry.field_k(points[i].field_k),
                                       points[i].variation_k, scene.options());
        const double kelvin = settled.estimate.temperature_k;
        const double key = hottest ? -kelvin : kelvin + certainty * settled.estimate.uncertainty_k;
        if (!settled.agreement.two_camps) order.emplace_back(key, i);
      }));
  std::sort(order.begin(), order.end());
  std::vector<PlacedReading> found;
  for (const auto& [key, i] : order) {
    if (static_cast<int>(found.size()) >= count) break;
    const Eigen::Vector3d& position = points[i].position;
    if (std::any_of(found.begin(), found.end(), [&](const PlacedReading& other) {
          return (other.position - position).norm() < apart;
        }))
      continue;
    ORBITFUSE_ASSIGN(TemperatureReading reading, read_spot(scene, points[i], radiometry, progress));
    found.push_back({position, points[i].normal, std::move(reading)});
  }
  std::stable_sort(found.begin(), found.end(), [&](const auto& one, const auto& other) {
    const double difference = one.reading.temperature_k - other.reading.temperature_k;
    return hottest ? difference > 0 : difference < 0;
  });
  return found;
}

}  // namespace orbitfuse::measurement
