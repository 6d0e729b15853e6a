// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "recon/poses/sfm/tracks.hpp"

namespace orbitfuse {

/// What a pair's verified matches say of the poses of its frames.
struct PairVote {
  ViewPair pair;
  std::size_t matches = 0, held = 0;
};
/// Of all pairs whose frames both have a pose.
std::vector<PairVote> votes_of(const FeatureGraph& graph, const PosedFrames& posed);

/// What the matches that two-view geometry held say of the poses of the frames that they join.
struct HeldMatches {
  double share = 1;      ///< of all of them, those that the poses hold
  int contradicted = 0;  ///< pairs of 30 and more of which the poses hold less than a quarter
  double contradicted_share = 0;  ///< of all matches, those of such pairs
  /// Pairs like that which count for nothing: so many matches that the poses hold join their two
  /// frames by way of others that a repeated pattern is likelier than all of those being false.
  int outvoted = 0;
  /// Pairs like that which count for nothing because they were told to be mistaken.
  int mistaken = 0;

  /// Too many speak against the poses. Right models of twelve scenes, with and without stations,
  /// have 0.01 of their matches in such pairs at most; wrong ones, of repeated pillars, of trees
  /// and of a focal length told 15 % too long, 0.024 and more (docs/notes/poses_visible.md). One
  /// pair alone may be chance.
  bool contradict() const {
    // Of a model that is right, equal sides made .21 to .23 of the matches false (`drums`); where
    // half and more are, of eight sides (`kiosk`), the rest may be chance as well.
    constexpr double least_held = 0.65;
    return (contradicted >= 2 && contradicted_share > 0.015) ||
           (mistaken > 0 && share < least_held);
  }
};
/// `mistaken`: of pairs that contradict the poses, those that something else contradicts as well.
using PairQuestion = std::function<bool(const PairVote&)>;
HeldMatches held_matches(const FeatureGraph& graph, const PosedFrames& posed,
                         const PairQuestion& mistaken = {});

}  // namespace orbitfuse
