// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/modality.hpp"
#include "core/result.hpp"
#include "core/session/session.hpp"

namespace orbitfuse {

/// The orbits to be walked: one station every spacing_deg on every loop.
struct OrbitPlan {
  double spacing_deg = 30;  ///< what the reconstruction is built for
  std::vector<double> loop_elevations_deg{10, 30, 55};
  double azimuth_tolerance_deg = 5;
  double elevation_tolerance_deg = 7;  ///< half of the band round a loop's elevation
  std::vector<Modality> modalities{Modality::visible, Modality::thermal};

  int sectors_per_loop() const;
  Status validate() const;
};

/// Where the camera stands, as the mat, the turntable, the operator or odometry says.
struct OrbitPosition {
  double azimuth_deg = 0, elevation_deg = 0;
  double sigma_deg = 0;  ///< one standard deviation
  double speed_deg_s = 0;
};

/// What is known of one frame when it is judged.
struct FrameAssessment {
  Modality modality = Modality::visible;
  std::string file;                          ///< empty: not on disk
  std::optional<OrbitPosition> position;     ///< absent: the camera is lost
  std::optional<EdgeBlur> edge_blur;         ///< absent: not measured
  double sharpness = 0;                      ///< relative to what this view can have, 0..1
  std::optional<double> rank;                ///< the higher of two stays; absent: by sharpness
  double overexposed = 0, underexposed = 0;  ///< shares of pixels
  bool nuc = false;                          ///< during or right after a shutter correction
};

struct CoverageOptions {
  double min_sharpness = 0.25;  ///< a blur of one pixel costs nine tenths
  /// Wider edges are blurred, whatever there is to compare with. Measured (bench_sharpness): sharp
  /// visible images have up to 1.4 px, and 1.8 px or more once blurred by 2 px; thermal images have
  /// up to 3.1 px where there is little but noise, and 2.8 px or more once blurred by 3 px.
  double max_visible_edge_px = 1.75, max_thermal_edge_px = 3.2;
  double max_clipped = 0.25;    ///< share of over- or underexposed pixels
  double rest_speed_deg_s = 2;  ///< at 1/100 s this blurs 0.3 px at 640 px, 25 deg
  double max_sigma_deg = 1;     ///< a position less sure than this proves nothing

  Status validate() const;
};

enum class Refusal {
  none,
  not_on_disk,
  lost,
  nuc,
  moving,
  blurred,
  featureless,
  badly_exposed,
  position_unsure,
  between_stations,
  out_of_band
};
/// A short text for the operator: "too fast", "blurred", ...
std::string text(Refusal refusal);

/// The frame that stands for a sector.
struct SectorFrame {
  std::string file;
  double rank = 0;
};

struct Sector {
  int loop = 0, index = 0;
  double azimuth_deg = 0, elevation_deg = 0;
  /// The best frame so far that passed every test; absent: the sector is missing.
  std::map<Modality, SectorFrame> best = {};

  bool done(Modality modality) const { return best.count(modality) > 0; }
};

/// Which sectors are done. A sector is done for a modality only by a frame that is on disk, at
/// rest, sharp, well exposed, in the elevation band, within the azimuth tolerance, outside a NUC
/// and whose position is sure.
class Coverage {
 public:
  explicit Coverage(OrbitPlan plan, CoverageOptions options = {});

  /// Judges a frame and, if nothing speaks against it, fills its sector.
  Refusal add(const FrameAssessment& frame);

  const OrbitPlan& plan() const { return plan_; }
  const std::vector<Sector>& sectors() const { return sectors_; }
  int done_count(Modality modality) const;
  bool complete() const;
  std::vector<const Sector*> missing(Modality modality) const;
  /// The missing sector that is nearest on foot; without a position the first; nullptr: all done.
  const Sector* target(Modality modality, const std::optional<OrbitPosition>& now) const;

  /// What to do next, in words: "12° further left, a little higher", "hold still", "done".
  std::string instruction(Modality modality, const std::optional<OrbitPosition>& now,
                          Refusal last = Refusal::none) const;

 private:
  const Sector* nearest_missing(Modality modality, const OrbitPosition& now) const;
  OrbitPlan plan_;
  CoverageOptions options_;
  std::vector<Sector> sectors_;
};

/// Smallest signed difference a - b of two angles, in [-180, 180).
double angle_difference_deg(double a_deg, double b_deg);

}  // namespace orbitfuse
