// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/alignment/view_verdict.hpp"

// What a thermal view's two scenes, the visible one's form and the others' temperatures, say of its
// place, and whose word counts. Internal to recon/poses.
namespace orbitfuse {

/// Of their loop's median support among temperatures. Right places on `container` had 0.7 or more,
/// wrong ones 0.4 at most.
inline constexpr double found_support_share = 0.5;
/// Among stations, which see less of each other's scene: below it a station is searched again.
inline constexpr double settled_support_share = 0.6;
/// Of the views' median correlation with what the others paint: an image so much like it is not far
/// from there, though few of its edges say so. Gables of a hut, seen from low down, had .98 to 1.01
/// of it.
inline constexpr double like_correlation_share = 0.95;
/// The same before the bundle, of a view that goes into it on probation: its neighbours' patches
/// can draw it to its place, where like_correlation_share is asked of it, and patches. Before it,
/// views of `sedan` that no place was found for had up to .60, ones that came right .84 and more.
inline constexpr double probation_correlation_share = 0.75;

/// A view that the others' temperatures contradict, from where they place it best. Supports are
/// shares of its loop's median one in the same scene.
struct PlaceEvidence {
  bool agree = false;             ///< form, started there, stays within a degree
  double temperatures_there = 0;  ///< among temperatures
  double form_there = 0;          ///< in the visible scene
  double form_before = 0;         ///< in the visible scene, where it was
  bool stays = false;             ///< temperatures place it within a degree of where it was
};

/// Whose word places the view. It only moves to a place that temperatures find or
/// that form knows well enough to vouch for.
enum class MoveDecision { both, temperatures_alone, form_alone, nobody };
MoveDecision who_places(const PlaceEvidence& seen);

/// Of a view that one or both place: sure where both do, and form knows it there no less than where
/// it was. `elsewhere`: it has moved to another place, `moved_deg` away.
ViewVerdict verdict_of_move(MoveDecision decision, const PlaceEvidence& seen, double moved_deg,
                            bool elsewhere);

/// Of a view that nobody places: doubtful where patches of other thermal views can still tell (they
/// make it sure, judged()), on probation where it may look right yet, else dropped. `likeness`: its
/// image's correlation with what the others measured at the better of its two places, of the median
/// view's.
ViewVerdict verdict_of_unplaced(bool agree, double apart_deg, double likeness);

/// Of its loop's median support; 0 where the loop has none: shares of nothing say nothing.
double share_of_median(double support, double median);

}  // namespace orbitfuse
