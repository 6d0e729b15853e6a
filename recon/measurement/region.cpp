// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/region.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "core/system/parallel.hpp"
#include "recon/measurement/estimate.hpp"

namespace orbitfuse::measurement {
namespace {

constexpr int points_per_block = 256;
/// Extremes are looked for where their temperature is sure: at an edge frames mix two surfaces, and
/// among thousands of points one in ten is farther off than its uncertainty says.
constexpr double certainty = 2;

Estimate estimate_of(const PointReadings& readings, double field_k, double variation_k,
                     const MeasurementOptions& options) {
  std::vector<WeightedReading> list;
  double gain = 0;
  for (const FrameReading& r : readings.frames) {
    list.push_back({r.temperature_k, r.gradient_k_per_px, r.weight});
    gain += r.weight * r.gain;
  }
  return estimate(list, {field_k, gain * variation_k, gain}, options);
}

double weighted_angle(const std::vector<FrameLine>& frames) {
  double sum = 0, weight = 0;
  for (const FrameLine& line : frames) sum += line.weight * line.angle_deg, weight += line.weight;
  return sum / weight;
}

/// Every point's readings. The frames' images and depth maps are made first, one after the other:
/// workers that waited for each other's would stand still.
Result<std::vector<PointReadings>> read_all(const ThermalScene& scene,
                                            const std::vector<SurfacePoint>& points,
                                            const Reradiometry& radiometry,
                                            const Progress& progress) {
  for (std::size_t i = 0; i < scene.frames().size(); ++i) {
    ORBITFUSE_TRY(scene.seen(i, progress));
    ORBITFUSE_TRY(scene.image(i));
  }
  std::vector<PointReadings> readings(points.size());
  std::vector<Status> problems(points.size());
  parallel_blocks(static_cast<int>(points.size()), points_per_block, [&](int begin, int end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      auto read = read_frames(scene, points[i], radiometry, progress);
      if (read)
        readings[i] = *std::move(read);
      else
        problems[i] = tl::unexpected(read.error());
    }
  });
  for (const Status& problem : problems) ORBITFUSE_TRY(problem);
  return readings;
}

/// What one frame saw of a region.
struct FrameSum {
  double area = 0, temperature = 0, offset = 0, angle = 0, gradient2 = 0, weight = 0;
  double gain = 0;
  double min_k = std::numeric_limits<double>::infinity(), max_k = -min_k;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();

  void add(const FrameReading& r, double point_k, double point_area) {
    area += point_area;
    temperature += point_area * r.temperature_k;
    offset += point_area * (r.temperature_k - point_k);
    angle += point_area * r.angle_deg;
    gradient2 += point_area * r.gradient_k_per_px * r.gradient_k_per_px;
    weight += point_area * r.weight;
    gain += point_area * r.weight * r.gain;
    pixel += point_area * r.pixel;
    min_k = std::min(min_k, r.temperature_k);
    max_k = std::max(max_k, r.temperature_k);
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
};

FrameLine line_of(const ThermalScene& scene, std::size_t frame, const FrameSum& s, double all_area,
                  double all_weight) {
  const ThermalFrame& of = scene.frames()[frame];
  return {.frame = of.view.name,
          .pixel = s.pixel / s.area,
          .mean_k = s.temperature / s.area,
          .min_k = s.min_k,
          .max_k = s.max_k,
          .angle_deg = s.angle / s.area,
          .weight = s.weight / all_weight,
          .covered = s.area / all_area,
          .doubtful = of.doubtful()};
}

}  // namespace

Result<TemperatureReading> read_spot(const ThermalScene& scene, const SurfacePoint& surface,
                                     const Reradiometry& radiometry, const Progress& progress) {
  ORBITFUSE_ASSIGN(const PointReadings readings, read_frames(scene, surface, radiometry, progress));
  TemperatureReading result;
  result.field_k = radiometry.field_k(surface.field_k);
  result.hidden = readings.why_hidden();
  if (!readings.seen()) return result;
  const Estimate e = estimate_of(readings, result.field_k, surface.variation_k, scene.options());
  result.temperature_k = e.temperature_k;
  result.uncertainty_k = e.uncertainty_k;
  result.spread_k = e.spread_k;
  PointSum sum;
  for (const FrameReading& r : readings.frames) {
    sum.add(r.temperature_k, 1, e.temperature_k);
    result.frames.push_back({.frame = scene.frames()[r.frame].view.name,
                             .pixel = r.pixel,
                             .mean_k = r.temperature_k,
                             .min_k = r.temperature_k,
                             .max_k = r.temperature_k,
                             .angle_deg = r.angle_deg,
                             .weight = r.weight,
                             .doubtful = scene.frames()[r.frame].doubtful()});
  }
  const double offset = sum.sum / sum.area;
  result.mean_k = e.temperature_k + offset;
  result.min_k = sum.min_k;
  result.max_k = sum.max_k;
  result.standard_deviation_k = std::sqrt(std::max(0.0, sum.squares / sum.area - offset * offset));
  result.angle_deg = weighted_angle(result.frames);
  return result;
}

Result<TemperatureReading> read_region(const ThermalScene& scene,
                                       const std::vector<SurfacePoint>& points,
                                       const Reradiometry& radiometry, const Progress& progress) {
  ORBITFUSE_ASSIGN(const std::vector<PointReadings> readings,
                   read_all(scene, points, radiometry, progress));
  TemperatureReading result;
  result.points = static_cast<int>(points.size());
  std::map<std::size_t, FrameSum> frames;
  PointSum seen, field;
  double reference_k = unknown, all_weight = 0;
  std::array<int, hidden_kinds> hidden{};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double field_k = radiometry.field_k(points[i].field_k), area = points[i].weight;
    if (std::isfinite(field_k)) field.add(field_k, area, 0);
    for (std::size_t k = 0; k < hidden_kinds; ++k) hidden[k] += readings[i].hidden[k];
    if (!readings[i].seen()) continue;
    const double point_k = estimate_of(readings[i], field_k, 0, scene.options()).temperature_k;
    if (std::isnan(reference_k)) reference_k = point_k;
    seen.add(point_k, area, reference_k);
    for (const FrameReading& r : readings[i].frames) frames[r.frame].add(r, point_k, area);
  }
  if (field.area > 0) result.field_k = field.sum / field.area;
  if (frames.empty()) {
    result.hidden = PointReadings{{}, hidden}.why_hidden();
    return result;
  }
  const double mean = seen.sum / seen.area;
  result.mean_k = reference_k + mean;
  result.min_k = seen.min_k;
  result.max_k = seen.max_k;
  result.standard_deviation_k = std::sqrt(std::max(0.0, seen.squares / seen.area - mean * mean));
  std::vector<WeightedReading> offsets;
  double gain = 0;
  for (const auto& [frame, s] : frames) all_weight += s.weight, gain += s.gain;
  for (const auto& [frame, s] : frames) {
    result.frames.push_back(line_of(scene, frame, s, seen.area, all_weight));
    offsets.push_back({result.mean_k + s.offset / s.area, std::sqrt(s.gradient2 / s.area),
                       s.weight / all_weight});
  }
  const Estimate e = estimate(offsets, {result.field_k, 0, gain / all_weight}, scene.options());
  result.temperature_k = result.mean_k;
  result.uncertainty_k = e.uncertainty_k;
  result.spread_k = e.spread_k;
  result.angle_deg = weighted_angle(result.frames);
  return result;
}

Result<std::vector<PlacedReading>> extremes(const ThermalScene& scene,
                                            const std::vector<SurfacePoint>& points, bool hottest,
                                            int count, double apart, const Reradiometry& radiometry,
                                            const Progress& progress) {
  ORBITFUSE_ASSIGN(const std::vector<PointReadings> readings,
                   read_all(scene, points, radiometry, progress));
  const std::size_t enough = std::min<std::size_t>(2, scene.frames().size());
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (readings[i].frames.size() < enough) continue;
    const Estimate e = estimate_of(readings[i], radiometry.field_k(points[i].field_k),
                                   points[i].variation_k, scene.options());
    order.emplace_back(certainty * e.uncertainty_k + (hottest ? -e.temperature_k : e.temperature_k),
                       i);
  }
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
