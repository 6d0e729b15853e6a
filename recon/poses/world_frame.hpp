// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/geometry/transform.hpp"
#include "core/result.hpp"
#include "core/session/session.hpp"

// The world of a reconstruction is free up to a similarity. Ours is chosen so that orbits, crops
// and cameras mean something in it: z up, the origin where the cameras look, median distance 1.
namespace orbitfuse {

/// Whether there is a station, and more known of it than its place in the order of the views.
bool tells_azimuth(const std::optional<Station>& station);

/// All stations were declared with the images, so many degrees apart as somebody said; the guide
/// measures them.
bool have_declared_stations(const std::vector<const FrameRecord*>& frames);

/// Stations of that modality tell no azimuth any more (a sigma of 180 degrees; in a manifest it
/// would be read as declared again).
Session in_order_alone(Session session, Modality modality);

/// Every frame has a station that tells its azimuth.
bool all_have_stations(const std::vector<const FrameRecord*>& frames);

/// Azimuth of the first view (or the stations' circular mean offset, where stations exist) becomes
/// that of the world. Identity for fewer than two views.
Similarity3d canonical_from_world(const std::vector<PosedView>& views,
                                  const std::vector<const FrameRecord*>& frames);

/// Takes poses and points into another world.
void move_world(Reconstruction& model, const Similarity3d& new_from_old);

struct OrbitAngles {
  double azimuth_deg = 0, elevation_deg = 0, radius = 0;
};
/// Of a camera centre in a canonical world.
OrbitAngles orbit_angles(const Eigen::Vector3d& center);

/// How well posed views agree with their stations, after the best offset in azimuth.
struct StationFit {
  int views = 0;
  bool mirrored = false;  ///< the stations run clockwise against the poses
  double offset_deg = 0;  ///< azimuth = +-station + offset
  double median_residual_deg = 0;
  double worst_residual_deg = 0;
  int outliers = 0;  ///< residual above 20 deg + 3 sigma
  /// Outliers that look from another side: more than 45 deg as directions, which a station
  /// miscounted by one, or any azimuth of a view from high above, is not.
  std::vector<std::string> folded;
};
/// Nothing when fewer than three views have stations. Azimuths are the views' in their own
/// canonical frame, so nothing of the world has to be right.
std::optional<StationFit> fit_stations(const std::vector<PosedView>& views, const Session& session);

/// How the posed views follow each other in the order they were recorded in. A camera carried round
/// neither leaps across its orbit between two frames nor turns back all the time; a model that
/// merged front and back of a near-symmetric object has it do so.
struct CaptureOrder {
  int steps = 0;       ///< between successive posed frames of one stream
  int leaps = 0;       ///< more than 60 deg off the usual step, without a change of loop
  int reversals = 0;   ///< more than 5 deg against the usual direction
  bool dense = false;  ///< frames between the stations too: steps under 20 deg
  /// Among stations alone, one made up for at the end is a leap, and one view astray is two.
  bool contradicted() const {
    return leaps > (dense ? steps / 50 : std::max(2, steps / 16)) || 4 * reversals > steps;
  }
};
/// Only stations and tracking frames have an order that means something; steps = 0 for others.
CaptureOrder capture_order(const std::vector<PosedView>& views, const Session& session);

/// Views that stand evenly round the orbit in the order of their stations, whatever azimuths these
/// say.
struct EvenSpacing {
  /// Negative: clockwise. That of a closed loop where one is nearer to the usual step.
  double spacing_deg = 0;
  /// More than 20 degrees from where it has them. Of a model that merged front and back it is half
  /// the views.
  std::vector<std::string> astray;
};
/// The spacing that views are least off; nothing for fewer than three views with stations.
std::optional<EvenSpacing> even_spacing(const std::vector<PosedView>& views,
                                        const Session& session);

/// Between successive stations of a loop, as they say; nothing where no loop has two.
std::optional<double> station_spacing_deg(const std::vector<const FrameRecord*>& frames);

/// Stations of that modality in their order, but so far apart, in as many loops as that makes.
Session at_spacing(Session session, Modality modality, double spacing_deg);

}  // namespace orbitfuse
