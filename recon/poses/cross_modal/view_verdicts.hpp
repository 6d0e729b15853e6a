// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "recon/poses/cross_modal/orbit_refinement.hpp"

// What the poses of an orbit are worth, judged across loops: a loop that is wrong as a whole agrees
// with itself. None of this needs the truth.
namespace orbitfuse {

/// What is known of one view's pose.
struct ViewEvidence {
  /// Support against renders, as a share of the median of all loops: a low loop sees less form (0.7
  /// where it is right), a wrong one has next to none (0.16).
  double support_share = 0;
  /// Of its image with what the other views' temperatures show from there; none where too little
  /// is painted to say.
  std::optional<double> correlation;
  /// From where its loop has it. Where stations were assumed: by how much it steps back behind the
  /// view before it or past the next one, and from the nearest loop's elevation, since where one
  /// loop ends is a guess.
  double azimuth_off_deg = 0, elevation_off_deg = 0;
  double log_distance_off = 0;  ///< from the common distance of all loops
  double aim_off = 0;  ///< orbit's centre from the principal point, share of the image's width
  double azimuth_scatter_deg = 0;  ///< of all views, robust sigma: how well stations were kept
  double median_correlation = 0;   ///< of all views
  /// Patches that other thermal views show where the pose has them, as a share of the median
  /// view's; 0 where that has too few.
  double confirmed_share = 0;
  /// The median of its loop's other stations' support_share; 0 where they are fewer than three, or
  /// there is no other loop to compare them with.
  double loop_support_share = 0;
  /// The median view has enough patches: few of them speak against a view.
  bool patches_tell = false;
};

/// One entry a view; stations are the first so many. Errors: the renderer's, cancelled.
Result<std::vector<ViewEvidence>> evidence_of(const OrbitRefinement& refinement,
                                              std::size_t stations, const Fit& alignment);

/// `before` is what restarts and temperatures said. A view that passed there may still fail here.
ViewVerdict judged(const ViewEvidence& evidence, const ViewVerdict& before);

/// The same of a frame recorded between stations: it is predicted by its neighbours' places alone,
/// so that it must be supported nearly as well as they are.
ViewVerdict judged_between(const ViewEvidence& evidence, const ViewVerdict& before);

/// Where most of a loop's stations are not sure, none of its views is. Returns those loops.
/// Stations are the first so many views.
std::vector<int> doubt_whole_loops(const OrbitViews& orbit, std::size_t stations, Fit& alignment);

/// Evidence gathered and verdicts given, in alignment.views. Returns the loops in doubt.
Result<std::vector<int>> judge_views(const OrbitRefinement& refinement, std::size_t stations,
                                     Fit& alignment);

}  // namespace orbitfuse
