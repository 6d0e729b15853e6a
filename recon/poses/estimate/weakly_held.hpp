// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/poses/estimate/weakest_joint.hpp"
#include "recon/poses/estimate_poses.hpp"

namespace orbitfuse {

struct WeaklyHeldOptions {
  /// Of a view's points, how many two other views whose poses are sure have to see. Points of two
  /// views hold how a pair is turned, but each pair at a scale of its own: what they chain drifts
  /// while every residual is small.
  int fewest_points = 30;
  /// Of center_uncertainty().
  double most_uncertain = 0.0025;
};

/// Views whose poses the points don't hold well enough to be trusted; none for a model of two,
/// which has no third to ask. A doubtful view vouches for no other.
///
/// Both constants were chosen on eleven scenes (docs/notes/poses_visible.md): right views have 30
/// points and more there and are uncertain by 0.18 % at most (but for one of the hall's); of a bare
/// hall, the one of 24 that is 10.5 % off has 11, its neighbour, 5.3 % off, 27 without it, and the
/// third, 2.6 % off, is uncertain by 0.35 %.
std::vector<DoubtfulView> weakly_held(const Reconstruction& model,
                                      const WeaklyHeldOptions& options = {});

/// The weakest joint of the model, or of its sure views alone where that is weaker: a doubtful view
/// vouches for no other, nor for how two parts lie that it joins.
Joint weakest_sure_joint(const Reconstruction& model, const std::vector<DoubtfulView>& doubtful);

/// The views beyond a loose joint: right in themselves, but not sure where the rest is. Adds those
/// that are not in doubt already; nothing where the joint is not loose.
void doubt_beyond(const Joint& joint, const Reconstruction& model,
                  std::vector<DoubtfulView>& doubtful);

/// Where most views are in doubt the others are too: a few that agree among themselves may be what
/// is wrong. Four sure ones of fifteen were (`drums` 51, cut off after 15 photos; up to 7.8 % of
/// the radius off, three of the doubtful right to 0.1 %).
void doubt_minority(const Reconstruction& model, std::vector<DoubtfulView>& doubtful);

}  // namespace orbitfuse
