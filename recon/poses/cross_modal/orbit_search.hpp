// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/transform.hpp"
#include "core/progress.hpp"
#include "core/session/session.hpp"
#include "recon/poses/cross_modal/line_model.hpp"

// Where on its orbit was a loop of views taken? Rendered lines are correlated with the views over
// azimuth, elevation, distance and image shift; the views of the stations vote together for the one
// start angle, which a single view of a near-symmetric object can't decide.
namespace orbitfuse {

/// A camera on a sphere about the world's origin (z up), turned by a small amount off the centre.
struct OrbitPose {
  double azimuth_deg = 0, elevation_deg = 0, radius = 1;
  double roll_deg = 0;
  double shift_x_px = 0, shift_y_px = 0;  ///< where the origin is seen, from the principal point
};
Rigid3d cam_from_world_of(const OrbitPose& pose, const Camera& camera);

/// One view to place.
struct SearchView {
  cv::Mat field;
  Camera camera;
};

struct OrbitSearchOptions {
  double azimuth_step_deg = 7.5;
  std::vector<double> elevations_deg = {4, 12, 20, 28, 37, 48, 62};
  double nearest = 0.5, farthest = 3, radius_ratio = 1.12;  ///< world units
  int columns = 80;                                         ///< cells of the correlated fields
  double max_shift = 0.25;                                  ///< of the image's width
  double max_station_error_deg = 16;
  int hypotheses = 2;  ///< returned at most
  int starts = 5;      ///< of a view, at most
  /// Loops of one operator are walked at one distance, give or take: mean correlation that a view
  /// costs whose loop leaves the common distance by `distance_log_sigma`. Alone, a low loop whose
  /// strongest edge (the horizon) has no line in the visible scene settled at half its distance.
  double distance_cost = 0.005, distance_log_sigma = 0.15;
};

/// One start angle and direction that the views may have been taken with.
struct OrbitHypothesis {
  std::vector<Station> stations;  ///< that were taken for declared, one a view
  std::vector<OrbitPose> poses;   ///< one a view
  /// Places of each view worth refining, best first: one peak of a coarse table is often wrong.
  std::vector<std::vector<OrbitPose>> starts;
  /// Where each view's loop has it, at its nominal azimuth.
  std::vector<OrbitPose> nominal;
  double offset_deg = 0;  ///< world azimuth of station azimuth 0
  double radius = 0;      ///< common to the loops
  bool mirrored = false;  ///< stations run clockwise
  double score = 0;       ///< mean correlation less what the distances cost, [-1, 1]
};

/// Peak correlation of a view and a candidate, and the image shift it is reached at.
struct OrbitPeak {
  float score = -1;
  std::int16_t dx = 0, dy = 0;  ///< cells
};

/// Every view's correlation with the lines as seen from every place. It doesn't depend on stations:
/// made once, it answers for every way the views may have been taken.
struct OrbitTable {
  int azimuths = 0, elevations = 0;
  std::vector<double> radii;
  double cell_px = 1;
  std::vector<std::vector<OrbitPeak>> of_view;

  const OrbitPeak& at(std::size_t view, int azimuth, int elevation, int radius) const;
};
/// Errors: cancelled.
Result<OrbitTable> tabulate_orbit(const LineModel& lines, const std::vector<SearchView>& views,
                                  const OrbitSearchOptions& options, const Progress& progress);

/// The best hypotheses, best first, whose starts differ by 40 deg, in direction or by a third in
/// distance; at most two of one start and direction. A near-symmetric object gives two of nearly
/// equal score, and so does a near orbit that lays another edge on the horizon: which is right
/// shows only against renders.
std::vector<OrbitHypothesis> search_orbit(const OrbitTable& table,
                                          const std::vector<Station>& stations,
                                          const OrbitSearchOptions& options);

/// How views of which only the order is known may have been taken: in one, two or three loops of
/// even steps.
std::vector<std::vector<Station>> station_layouts(std::size_t views);

}  // namespace orbitfuse
