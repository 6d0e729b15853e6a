// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/orbit_search.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/system/parallel.hpp"
#include "recon/alignment/edge_field.hpp"

namespace orbitfuse {
namespace {

constexpr double radians = 3.14159265358979323846 / 180.0;

/// Peak correlation and its shift for one view and one candidate.
struct Peak {
  float score = -1;
  std::int16_t dx = 0, dy = 0;  ///< cells
};

/// Scores over (azimuth, elevation, radius) for every view.
struct Table {
  int azimuths = 0, elevations = 0, radii = 0;
  std::vector<std::vector<Peak>> of_view;

  std::size_t index(int a, int e, int r) const {
    a = (a % azimuths + azimuths) % azimuths;
    return (static_cast<std::size_t>(a) * static_cast<std::size_t>(elevations) +
            static_cast<std::size_t>(e)) *
               static_cast<std::size_t>(radii) +
           static_cast<std::size_t>(r);
  }
};

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

cv::Mat spectrum(const cv::Mat& cells, cv::Size size) {
  cv::Mat padded(size, CV_32FC2, cv::Scalar::all(0));
  cells.copyTo(padded(cv::Rect(0, 0, cells.cols, cells.rows)));
  cv::dft(padded, padded);
  return padded;
}

Peak peak_of(const cv::Mat& view_spectrum, const cv::Mat& model_spectrum, float norms, int max_dx,
             int max_dy) {
  cv::Mat product, correlation;
  cv::mulSpectrums(view_spectrum, model_spectrum, product, 0, true);
  cv::dft(product, correlation, cv::DFT_INVERSE | cv::DFT_SCALE);
  Peak best;
  for (int dy = -max_dy; dy <= max_dy; ++dy) {
    const auto* row = correlation.ptr<cv::Vec2f>((dy + correlation.rows) % correlation.rows);
    for (int dx = -max_dx; dx <= max_dx; ++dx) {
      const float score = row[(dx + correlation.cols) % correlation.cols][0] / norms;
      if (score > best.score)
        best = {score, static_cast<std::int16_t>(dx), static_cast<std::int16_t>(dy)};
    }
  }
  return best;
}

/// Best score of a view near a nominal azimuth, at one elevation and radius. Leaving the nominal
/// place costs a little: without it all starts within the tolerance would score alike.
double best_near(const Table& table, std::size_t view, double azimuth_deg, double tolerance_deg,
                 int e, int r, double step_deg) {
  constexpr double cost_at_tolerance = 0.04;
  const int center = static_cast<int>(std::lround(azimuth_deg / step_deg));
  const int reach = std::max(1, static_cast<int>(std::floor(tolerance_deg / step_deg)));
  double best = -1;
  for (int a = center - reach; a <= center + reach; ++a) {
    const double away = (a * step_deg - azimuth_deg) / tolerance_deg;
    best = std::max(best, static_cast<double>(table.of_view[view][table.index(a, e, r)].score) -
                              cost_at_tolerance * away * away);
  }
  return best;
}

struct Candidate {
  double score = -2;
  double offset_deg = 0;
  bool mirrored = false;
  std::map<int, std::pair<int, int>> loop_place;  ///< loop -> elevation, radius index
};

Candidate evaluate(const Table& table, const std::vector<SearchView>& views,
                    const OrbitSearchOptions& options, double offset_deg, bool mirrored) {
  Candidate h;
  h.offset_deg = offset_deg;
  h.mirrored = mirrored;
  h.score = 0;
  std::map<int, std::vector<std::size_t>> loops;
  for (std::size_t i = 0; i < views.size(); ++i) loops[views[i].station->loop].push_back(i);
  for (const auto& [loop, members] : loops) {
    double best_sum = -1e9;
    for (int e = 0; e < table.elevations; ++e)
      for (int r = 0; r < table.radii; ++r) {
        double sum = 0;
        for (const std::size_t i : members) {
          const double nominal =
              offset_deg + (mirrored ? -1 : 1) * views[i].station->azimuth_deg;
          sum += best_near(table, i, nominal, options.max_station_error_deg, e, r,
                           options.azimuth_step_deg);
        }
        if (sum > best_sum) {
          best_sum = sum;
          h.loop_place[loop] = {e, r};
        }
      }
    h.score += best_sum / static_cast<double>(views.size());
  }
  return h;
}

/// A view's best places near its loop's, which may be a step nearer or higher; neighbours of a
/// better place are left out.
std::vector<OrbitPose> start_poses(const Table& table, std::size_t view, const Station& station,
                                   const OrbitSearchOptions& options,
                                   const std::vector<double>& radii, double cell_px,
                                   const Candidate& candidate) {
  struct Place {
    int a, e, r;
    Peak peak;
  };
  const auto [le, lr] = candidate.loop_place.at(station.loop);
  const double nominal =
      candidate.offset_deg + (candidate.mirrored ? -1 : 1) * station.azimuth_deg;
  const int center = static_cast<int>(std::lround(nominal / options.azimuth_step_deg));
  const int reach = std::max(
      1, static_cast<int>(std::floor(options.max_station_error_deg / options.azimuth_step_deg)));
  std::vector<Place> places;
  for (int a = center - reach; a <= center + reach; ++a)
    for (int e = std::max(0, le - 1); e <= std::min(table.elevations - 1, le + 1); ++e)
      for (int r = std::max(0, lr - 1); r <= std::min(table.radii - 1, lr + 1); ++r)
        places.push_back({a, e, r, table.of_view[view][table.index(a, e, r)]});
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
    pose.radius = radii[static_cast<std::size_t>(place.r)];
    pose.shift_x_px = place.peak.dx * cell_px;
    pose.shift_y_px = place.peak.dy * cell_px;
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace

Rigid3d cam_from_world_of(const OrbitPose& pose, const Camera& camera) {
  const double a = pose.azimuth_deg * radians, e = pose.elevation_deg * radians;
  const Eigen::Vector3d out(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
  const Eigen::Vector3d right(-std::sin(a), std::cos(a), 0);
  Eigen::Matrix3d rotation;  // rows: camera axes in the world
  rotation.row(0) = right;
  rotation.row(1) = (-out).cross(right);
  rotation.row(2) = -out;
  const Eigen::Matrix3d aim =
      (Eigen::AngleAxisd(std::atan2(pose.shift_x_px, camera.fx), Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(-std::atan2(pose.shift_y_px, camera.fy), Eigen::Vector3d::UnitX()) *
       Eigen::AngleAxisd(pose.roll_deg * radians, Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  const Eigen::Quaterniond q(Eigen::Matrix3d(aim * rotation));
  return {q.normalized(), -(q.normalized() * (pose.radius * out))};
}

Result<std::vector<OrbitHypothesis>> search_orbit(const LineModel& lines,
                                                  const std::vector<SearchView>& views,
                                                  const OrbitSearchOptions& options,
                                                  const Progress& progress) {
  Table table;
  table.azimuths = static_cast<int>(std::lround(360 / options.azimuth_step_deg));
  table.elevations = static_cast<int>(options.elevations_deg.size());
  std::vector<double> radii;
  for (double r = options.nearest; r <= options.farthest; r *= options.radius_ratio)
    radii.push_back(r);
  table.radii = static_cast<int>(radii.size());
  const std::size_t places = static_cast<std::size_t>(table.azimuths * table.elevations) *
                             static_cast<std::size_t>(table.radii);
  table.of_view.assign(views.size(), std::vector<Peak>(places));

  const Camera& camera = views.front().camera;
  const int columns = options.columns;
  const int rows = std::max(1, columns * camera.height / camera.width);
  const double cell = static_cast<double>(camera.width) / columns;
  const auto max_dx = static_cast<int>(options.max_shift * columns);
  const auto max_dy = static_cast<int>(options.max_shift * columns);
  const cv::Size padded(cv::getOptimalDFTSize(columns + max_dx),
                        cv::getOptimalDFTSize(rows + max_dy));
  std::vector<cv::Mat> spectra;
  std::vector<double> norms;
  for (const SearchView& view : views) {
    const cv::Mat cells = cell_field(view.field, columns, rows);
    norms.push_back(cv::norm(cells));
    spectra.push_back(spectrum(cells, padded));
  }

  parallel_for(table.azimuths, [&](int a) {
    if (progress.cancelled()) return;
    for (int e = 0; e < table.elevations; ++e)
      for (int r = 0; r < table.radii; ++r) {
        OrbitPose pose;
        pose.azimuth_deg = a * options.azimuth_step_deg;
        pose.elevation_deg = options.elevations_deg[static_cast<std::size_t>(e)];
        pose.radius = radii[static_cast<std::size_t>(r)];
        const cv::Mat cells =
            rendered_cells(lines, camera, cam_from_world_of(pose, camera), columns, rows);
        const double norm = cv::norm(cells);
        if (!(norm > 0)) continue;
        const cv::Mat model = spectrum(cells, padded);
        for (std::size_t i = 0; i < views.size(); ++i)
          if (norms[i] > 0)
            table.of_view[i][table.index(a, e, r)] = peak_of(
                spectra[i], model, static_cast<float>(norm * norms[i]), max_dx, max_dy);
      }
  });
  ORBITFUSE_TRY(progress.check("poses.thermal"));

  std::vector<Candidate> candidates;
  for (int a = 0; a < table.azimuths; ++a)
    for (const bool mirrored : {false, true})
      candidates.push_back(
          evaluate(table, views, options, a * options.azimuth_step_deg, mirrored));
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& x, const Candidate& y) { return x.score > y.score; });

  std::vector<OrbitHypothesis> result;
  for (const Candidate& candidate : candidates) {
    const bool distinct =
        std::all_of(result.begin(), result.end(), [&](const OrbitHypothesis& h) {
          return h.mirrored != candidate.mirrored ||
                 std::abs(std::remainder(h.offset_deg - candidate.offset_deg, 360)) >= 40;
        });
    if (!distinct) continue;
    OrbitHypothesis hypothesis{{}, {}, candidate.offset_deg, candidate.mirrored, candidate.score};
    for (std::size_t i = 0; i < views.size(); ++i) {
      hypothesis.starts.push_back(
          start_poses(table, i, *views[i].station, options, radii, cell, candidate));
      hypothesis.poses.push_back(hypothesis.starts.back().front());
    }
    result.push_back(std::move(hypothesis));
    if (static_cast<int>(result.size()) >= options.hypotheses) break;
  }
  return result;
}

}  // namespace orbitfuse
