// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/place_evidence.hpp"

#include <fmt/format.h>

namespace orbitfuse {
namespace {

/// Of their loop's median support in the visible scene: views that form alone may vouch for.
constexpr double vouched_share = 0.6;
/// The same, of views that both scenes leave where they are.
constexpr double kept_share = 0.4;
/// What form and temperatures say of a view's place are not two places: within reach of the thermal
/// bundle's search, which decides (a right view of `van` was dropped at 1.1).
constexpr double close_deg = 2;
/// Rounding of no support at all.
constexpr double least_support = 1e-9;

}  // namespace

MoveDecision who_places(const PlaceEvidence& seen) {
  const bool found = seen.temperatures_there > settled_support_share;
  // Two scenes that show nothing of the view agree as easily as two that do: one must know it
  // there.
  const bool better_by_form =
      seen.form_there > vouched_share && seen.form_there >= seen.form_before;
  if (seen.agree && (found || better_by_form)) return MoveDecision::both;
  // Both know it there, temperatures a little less well than most.
  if (seen.agree && seen.temperatures_there > found_support_share &&
      seen.form_there > vouched_share)
    return MoveDecision::both;
  // Searched as a whole and found where it was: a weak view, but not a wrong one.
  if (seen.agree && seen.stays && seen.temperatures_there > kept_share &&
      seen.form_before > kept_share)
    return MoveDecision::both;
  // Temperatures know more edges: where they are sure, form alone doesn't pull a view away.
  if (!seen.agree && found) return MoveDecision::temperatures_alone;
  // Where they don't find it they don't speak against a place that form knows well, and better.
  if (!found && seen.form_before > vouched_share && seen.form_before > seen.form_there)
    return MoveDecision::form_alone;
  return MoveDecision::nobody;
}

ViewVerdict verdict_of_move(MoveDecision decision, const PlaceEvidence& seen, double moved_deg,
                            bool elsewhere) {
  if (decision == MoveDecision::form_alone)
    return {Confidence::doubtful, DoubtReason::temperatures_contradict,
            fmt::format("the other views' temperatures contradict its place and don't find it "
                        "elsewhere (at best {:.2f} of the median support); the visible scene alone "
                        "keeps it, at {:.2f} of its loop's median support",
                        seen.temperatures_there, seen.form_before)};
  // Two opinions that differ, or that agree on the place and not on which is the better one.
  const bool against_form =
      decision == MoveDecision::temperatures_alone || (seen.form_there < seen.form_before);
  if (!elsewhere || !against_form) return {};
  return {Confidence::doubtful, DoubtReason::temperatures_elsewhere,
          fmt::format("the other views' temperatures place it {:.1f} deg away, where the visible "
                      "scene supports it less: {:.2f} of the median support, {:.2f} before",
                      moved_deg, seen.form_there, seen.form_before)};
}

ViewVerdict verdict_of_unplaced(bool agree, double apart_deg, double likeness) {
  // Too near each other to be two places, or too much like what the others measured to be far off:
  // patches of other thermal views will tell.
  const bool left_to_patches =
      likeness >= like_correlation_share || (!agree && apart_deg < close_deg);
  const bool on_probation = !left_to_patches && likeness >= probation_correlation_share;
  const Confidence confidence =
      left_to_patches || on_probation ? Confidence::doubtful : Confidence::dropped;
  if (agree)
    return {confidence, DoubtReason::not_found,
            "neither the visible scene nor the other views' temperatures show its edges",
            on_probation};
  return {confidence, DoubtReason::temperatures_elsewhere,
          fmt::format("the visible scene and the other views' temperatures place it {:.1f} deg "
                      "apart",
                      apart_deg),
          on_probation};
}

double share_of_median(double support, double median) {
  return median > least_support ? support / median : 0;
}

}  // namespace orbitfuse
