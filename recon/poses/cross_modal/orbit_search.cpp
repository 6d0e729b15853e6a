// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/orbit_search.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/numeric/angle_units.hpp"
#include "core/system/parallel.hpp"
#include "recon/alignment/edge_field.hpp"

namespace orbitfuse {
namespace {

cv::Mat rendered_cells(const LineModel& lines, const Camera& camera, const Rigid3d& cam_from_world,
                       int columns, int rows) {
  const double cell = static_cast<double>(camera.width) / columns;
  cv::Mat cells(rows, columns, CV_32FC2, cv::Scalar::all(0));
  for (const LineModel::Sample& s : lines.samples(camera, cam_from_world, cell)) {
    const int x = std::min(columns - 1, static_cast<int>(s.pixel.x() / cell));
    const int y = std::min(rows - 1, static_cast<int>(s.pixel.y() / cell));
    const double c = s.normal.x() * s.normal.x() - s.normal.y() * s.normal.y();
    cells.at<cv::Vec2f>(y, x) +=
        cv::Vec2f(static_cast<float>(c), static_cast<float>(2 * s.normal.x() * s.normal.y()));
  }
  // However many lines share a cell, it holds one edge.
  for (cv::Vec2f& v : cv::Mat_<cv::Vec2f>(cells)) {
    const float n = std::hypot(v[0], v[1]);
    if (n > 1) v *= 1 / n;
  }
  return cells;
}

/// A field's two planes as spectra. Correlation is the sum of the planes' own, all of them real:
/// half the work of the complex field's.
struct Spectrum {
  cv::Mat1f re, im;
};

/// The field's first cell comes to `corner` of a frame of `size`.
Spectrum spectrum(const cv::Mat& cells, cv::Size size, cv::Point corner) {
  cv::Mat1f planes[2];
  cv::split(cells, planes);
  for (cv::Mat1f& plane : planes) {
    cv::Mat1f padded(size, 0.0F);
    plane.copyTo(padded(cv::Rect(corner, plane.size())));
    // Rows below the field are empty: they need no transform of their own.
    cv::dft(padded, plane, 0, corner.y + plane.rows);
  }
  return {planes[0], planes[1]};
}

/// `reach`: of the shift, in cells, which is where the view's field begins in its frame.
OrbitPeak peak_of(const Spectrum& view, const Spectrum& model, float norms, cv::Point reach) {
  cv::Mat1f product, of_im, correlation;
  cv::mulSpectrums(view.re, model.re, product, 0, true);
  cv::mulSpectrums(view.im, model.im, of_im, 0, true);
  product += of_im;
  const int rows = 2 * reach.y + 1;  // no others are looked at
  cv::dft(product, correlation, cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT, rows);
  OrbitPeak best;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x <= 2 * reach.x; ++x) {
      const float score = correlation(y, x) / norms;
      if (score > best.score)
        best = {score, static_cast<std::int16_t>(x - reach.x),
                static_cast<std::int16_t>(y - reach.y)};
    }
  return best;
}

/// Best score of a view near a nominal azimuth, at one elevation and radius. Leaving the nominal
/// place costs a little: without it all starts within the tolerance would score alike.
double best_near(const OrbitTable& table, std::size_t view, double azimuth_deg,
                 double tolerance_deg, int e, int r, double step_deg) {
  constexpr double cost_at_tolerance = 0.04;
  const int center = static_cast<int>(std::lround(azimuth_deg / step_deg));
  const int reach = std::max(1, static_cast<int>(std::floor(tolerance_deg / step_deg)));
  double best = -1;
  for (int a = center - reach; a <= center + reach; ++a) {
    const double away = (a * step_deg - azimuth_deg) / tolerance_deg;
    best = std::max(
        best, static_cast<double>(table.at(view, a, e, r).score) - cost_at_tolerance * away * away);
  }
  return best;
}

struct Candidate {
  double score = -2;
  double offset_deg = 0;
  bool mirrored = false;
  int radius = 0;                                 ///< index of the distance common to the loops
  std::map<int, std::pair<int, int>> loop_place;  ///< loop -> elevation, radius index
};

/// A loop's summed score and the elevation it is reached at, by radius.
struct LoopScores {
  std::size_t members = 0;
  std::vector<double> sum;
  std::vector<int> elevation;
};

std::map<int, LoopScores> loop_scores(const OrbitTable& table, const std::vector<Station>& stations,
                                      const OrbitSearchOptions& options, double offset_deg,
                                      bool mirrored) {
  std::map<int, std::vector<std::size_t>> loops;
  for (std::size_t i = 0; i < stations.size(); ++i) loops[stations[i].loop].push_back(i);
  std::map<int, LoopScores> scores;
  for (const auto& [loop, members] : loops) {
    LoopScores& of_loop = scores[loop];
    of_loop.members = members.size();
    of_loop.sum.assign(table.radii.size(), -1e9);
    of_loop.elevation.assign(table.radii.size(), 0);
    for (int r = 0; r < static_cast<int>(table.radii.size()); ++r)
      for (int e = 0; e < table.elevations; ++e) {
        double sum = 0;
        for (const std::size_t i : members) {
          const double nominal = offset_deg + (mirrored ? -1 : 1) * stations[i].azimuth_deg;
          sum += best_near(table, i, nominal, options.max_station_error_deg, e, r,
                           options.azimuth_step_deg);
        }
        const auto place = static_cast<std::size_t>(r);
        if (sum > of_loop.sum[place]) of_loop.sum[place] = sum, of_loop.elevation[place] = e;
      }
  }
  return scores;
}

/// One candidate for each distance that the loops may have in common.
void evaluate(const OrbitTable& table, const std::vector<Station>& stations,
              const OrbitSearchOptions& options, double offset_deg, bool mirrored,
              std::vector<Candidate>& candidates) {
  const auto scores = loop_scores(table, stations, options, offset_deg, mirrored);
  const auto radii = static_cast<int>(table.radii.size());
  for (int common = 0; common < radii; ++common) {
    Candidate candidate{0, offset_deg, mirrored, common, {}};
    for (const auto& [loop, of_loop] : scores) {
      double best = -1e9;
      for (int r = 0; r < radii; ++r) {
        const double sigmas =
            (r - common) * std::log(options.radius_ratio) / options.distance_log_sigma;
        const double value =
            of_loop.sum[static_cast<std::size_t>(r)] -
            static_cast<double>(of_loop.members) * options.distance_cost * sigmas * sigmas;
        if (value <= best) continue;
        best = value;
        candidate.loop_place[loop] = {of_loop.elevation[static_cast<std::size_t>(r)], r};
      }
      candidate.score += best / static_cast<double>(stations.size());
    }
    candidates.push_back(std::move(candidate));
  }
}

/// Whether a candidate says something that none of the better ones does.
bool distinct(const Candidate& candidate, const std::vector<Candidate>& better,
              const OrbitSearchOptions& options) {
  constexpr double other_start_deg = 40, other_distance = 0.3;
  int of_same_start = 0;
  for (const Candidate& b : better) {
    if (b.mirrored != candidate.mirrored ||
        std::abs(std::remainder(b.offset_deg - candidate.offset_deg, 360)) >= other_start_deg)
      continue;
    const double apart = (b.radius - candidate.radius) * std::log(options.radius_ratio);
    if (std::abs(apart) < other_distance || ++of_same_start == 2) return false;
  }
  return true;
}

/// A view's best places near its loop's, which may be a step nearer or higher; neighbours of a
/// better place are left out.
std::vector<OrbitPose> start_poses(const OrbitTable& table, std::size_t view,
                                   const Station& station, const OrbitSearchOptions& options,
                                   const Candidate& candidate) {
  struct Place {
    int a, e, r;
    OrbitPeak peak;
  };
  const auto [le, lr] = candidate.loop_place.at(station.loop);
  const double nominal = candidate.offset_deg + (candidate.mirrored ? -1 : 1) * station.azimuth_deg;
  const int center = static_cast<int>(std::lround(nominal / options.azimuth_step_deg));
  const int reach = std::max(
      1, static_cast<int>(std::floor(options.max_station_error_deg / options.azimuth_step_deg)));
  std::vector<Place> places;
  for (int a = center - reach; a <= center + reach; ++a)
    for (int e = std::max(0, le - 1); e <= std::min(table.elevations - 1, le + 1); ++e)
      for (int r = std::max(0, lr - 1);
           r <= std::min(static_cast<int>(table.radii.size()) - 1, lr + 1); ++r)
        places.push_back({a, e, r, table.at(view, a, e, r)});
  const auto value = [&](const Place& p) {
    return p.peak.score - 0.01F * static_cast<float>((p.a - center) * (p.a - center));
  };
  std::stable_sort(places.begin(), places.end(),
                   [&](const Place& x, const Place& y) { return value(x) > value(y); });
  std::vector<Place> kept;
  for (const Place& place : places) {
    const bool near_better = std::any_of(kept.begin(), kept.end(), [&](const Place& k) {
      return std::abs(k.a - place.a) <= 1 && k.e == place.e;
    });
    if (!near_better) kept.push_back(place);
    if (static_cast<int>(kept.size()) >= options.starts) break;
  }
  std::vector<OrbitPose> poses;
  for (const Place& place : kept) {
    OrbitPose pose;
    pose.azimuth_deg = place.a * options.azimuth_step_deg;
    pose.elevation_deg = options.elevations_deg[static_cast<std::size_t>(place.e)];
    pose.radius = table.radii[static_cast<std::size_t>(place.r)];
    pose.shift_x_px = place.peak.dx * table.cell_px;
    pose.shift_y_px = place.peak.dy * table.cell_px;
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace

Rigid3d cam_from_world_of(const OrbitPose& pose, const Camera& camera) {
  const double a = pose.azimuth_deg * radians_per_degree,
               e = pose.elevation_deg * radians_per_degree;
  const Eigen::Vector3d out(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
  const Eigen::Vector3d right(-std::sin(a), std::cos(a), 0);
  Eigen::Matrix3d rotation;  // rows: camera axes in the world
  rotation.row(0) = right;
  rotation.row(1) = (-out).cross(right);
  rotation.row(2) = -out;
  const Eigen::Matrix3d aim =
      (Eigen::AngleAxisd(std::atan2(pose.shift_x_px, camera.fx), Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(-std::atan2(pose.shift_y_px, camera.fy), Eigen::Vector3d::UnitX()) *
       Eigen::AngleAxisd(pose.roll_deg * radians_per_degree, Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  const Eigen::Quaterniond q(Eigen::Matrix3d(aim * rotation));
  return {q.normalized(), -(q.normalized() * (pose.radius * out))};
}

const OrbitPeak& OrbitTable::at(std::size_t view, int azimuth, int elevation, int radius) const {
  const auto a = static_cast<std::size_t>((azimuth % azimuths + azimuths) % azimuths);
  return of_view[view]
                [(a * static_cast<std::size_t>(elevations) + static_cast<std::size_t>(elevation)) *
                     radii.size() +
                 static_cast<std::size_t>(radius)];
}

Result<OrbitTable> tabulate_orbit(const LineModel& lines, const std::vector<SearchView>& views,
                                  const OrbitSearchOptions& options, const Progress& progress) {
  OrbitTable table;
  table.azimuths = static_cast<int>(std::lround(360 / options.azimuth_step_deg));
  table.elevations = static_cast<int>(options.elevations_deg.size());
  for (double r = options.nearest; r <= options.farthest; r *= options.radius_ratio)
    table.radii.push_back(r);
  const std::size_t places =
      static_cast<std::size_t>(table.azimuths * table.elevations) * table.radii.size();
  table.of_view.assign(views.size(), std::vector<OrbitPeak>(places));

  const Camera& camera = views.front().camera;
  const int columns = options.columns;
  const int rows = std::max(1, columns * camera.height / camera.width);
  table.cell_px = static_cast<double>(camera.width) / columns;
  const auto max_shift = static_cast<int>(options.max_shift * columns);
  const cv::Point reach(max_shift, max_shift);
  // Wide enough that what leaves on one side doesn't meet the view's field on the other.
  const cv::Size padded(cv::getOptimalDFTSize(columns + reach.x),
                        cv::getOptimalDFTSize(rows + reach.y));
  std::vector<Spectrum> spectra;
  std::vector<double> norms;
  for (const SearchView& view : views) {
    const cv::Mat cells = cell_field(view.field, columns, rows);
    norms.push_back(cv::norm(cells));
    spectra.push_back(spectrum(cells, padded, reach));
  }

  parallel_for(table.azimuths, [&](int a) {
    if (progress.cancelled()) return;
    for (int e = 0; e < table.elevations; ++e)
      for (std::size_t r = 0; r < table.radii.size(); ++r) {
        OrbitPose pose;
        pose.azimuth_deg = a * options.azimuth_step_deg;
        pose.elevation_deg = options.elevations_deg[static_cast<std::size_t>(e)];
        pose.radius = table.radii[r];
        const std::size_t place =
            static_cast<std::size_t>(a * table.elevations + e) * table.radii.size() + r;
        const cv::Mat cells =
            rendered_cells(lines, camera, cam_from_world_of(pose, camera), columns, rows);
        const double norm = cv::norm(cells);
        if (!(norm > 0)) continue;
        const Spectrum model = spectrum(cells, padded, {0, 0});
        for (std::size_t i = 0; i < views.size(); ++i)
          if (norms[i] > 0)
            table.of_view[i][place] =
                peak_of(spectra[i], model, static_cast<float>(norm * norms[i]), reach);
      }
  });
  ORBITFUSE_TRY(progress.check("poses.thermal"));
  return table;
}

std::vector<OrbitHypothesis> search_orbit(const OrbitTable& table,
                                          const std::vector<Station>& stations,
                                          const OrbitSearchOptions& options) {
  std::vector<Candidate> candidates;
  for (int a = 0; a < table.azimuths; ++a)
    for (const bool mirrored : {false, true})
      evaluate(table, stations, options, a * options.azimuth_step_deg, mirrored, candidates);
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& x, const Candidate& y) { return x.score > y.score; });
  std::vector<Candidate> kept;
  for (const Candidate& candidate : candidates) {
    if (static_cast<int>(kept.size()) >= options.hypotheses) break;
    if (distinct(candidate, kept, options)) kept.push_back(candidate);
  }

  std::vector<OrbitHypothesis> result;
  for (const Candidate& candidate : kept) {
    OrbitHypothesis hypothesis;
    hypothesis.offset_deg = candidate.offset_deg;
    hypothesis.mirrored = candidate.mirrored;
    hypothesis.score = candidate.score;
    hypothesis.stations = stations;
    hypothesis.radius = table.radii[static_cast<std::size_t>(candidate.radius)];
    for (std::size_t i = 0; i < stations.size(); ++i) {
      const Station& station = stations[i];
      hypothesis.starts.push_back(start_poses(table, i, station, options, candidate));
      hypothesis.poses.push_back(hypothesis.starts.back().front());
      const auto [e, r] = candidate.loop_place.at(station.loop);
      OrbitPose nominal;
      nominal.azimuth_deg =
          candidate.offset_deg + (candidate.mirrored ? -1 : 1) * station.azimuth_deg;
      nominal.elevation_deg = options.elevations_deg[static_cast<std::size_t>(e)];
      nominal.radius = table.radii[static_cast<std::size_t>(r)];
      hypothesis.nominal.push_back(nominal);
    }
    result.push_back(std::move(hypothesis));
  }
  return result;
}

std::vector<std::vector<Station>> station_layouts(std::size_t views) {
  // Fewer than six a loop leave steps of more than 60 deg: no order to hold a view to.
  constexpr std::size_t least_a_loop = 6;
  std::vector<std::vector<Station>> layouts;
  for (std::size_t loops = 1; loops <= 3 && (loops == 1 || views >= least_a_loop * loops);
       ++loops) {
    std::vector<Station> stations(views);
    for (std::size_t i = 0; i < views; ++i) {
      const std::size_t loop = i * loops / views;
      const std::size_t first = (loop * views + loops - 1) / loops;
      const std::size_t next = ((loop + 1) * views + loops - 1) / loops;
      stations[i].loop = static_cast<int>(loop), stations[i].index = static_cast<int>(i - first);
      stations[i].azimuth_deg =
          360.0 * static_cast<double>(i - first) / static_cast<double>(next - first);
      stations[i].azimuth_sigma_deg.reset(), stations[i].elevation_sigma_deg.reset();
    }
    layouts.push_back(std::move(stations));
  }
  return layouts;
}

}  // namespace orbitfuse
