// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

  /// Too many speak against the poses. Right models of twelve scenes, with and without stations,
  /// have 0.01 of their matches in such pairs at most; wrong ones, of repeated pillars, of trees
  /// and of a focal length told 15 % too long, 0.024 and more (docs/notes/poses_visible.md). One
  /// pair alone may be chance.
  bool contradict() const { return contradicted >= 2 && contradicted_share > 0.015; }
};
HeldMatches held_matches(const FeatureGraph& graph, const PosedFrames& posed);

}  // namespace orbitfuse
