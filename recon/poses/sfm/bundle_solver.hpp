// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "recon/alignment/projection.hpp"
#include "recon/alignment/trust_region.hpp"

// The least squares of bundle adjustment: poses, lenses and points from where points were seen.
// Points are eliminated (Triggs et al., Bundle adjustment - a modern synthesis, 2000); what is left
// is solved densely, or sparsely where there are many views. Ceres solves the same, on one thread
// where sums must not depend on their number, and took five times as long. Internal to sfm.
namespace orbitfuse {

/// What is believed of a lens: each value about its mean, but fy, whose ratio to fx is.
struct LensBelief {
  Intrinsics mean, sigma;
  double aspect_sigma = 0.002;
  std::array<bool, 8> held{};  ///< stay as they are
};

struct SeenPoint {
  int view = 0, point = 0;
  Eigen::Vector2d pixel;
  double unit_px = 1;  ///< what counts as a pixel in this view
};

class BundleSolver {
 public:
  struct State {
    std::vector<Eigen::Quaterniond> rotation;  ///< cam_from_world, of each view
    std::vector<Eigen::Vector3d> center;
    std::vector<Intrinsics> lens;
    std::vector<Eigen::Vector3d> point;
  };

  /// `lens_of[v]` indexes the lenses; `seen` is in the order of its points. Of more views than
  /// `dense_up_to` the equations are solved sparsely where they are sparse.
  BundleSolver(State start, std::vector<int> lens_of, std::vector<LensBelief> beliefs,
               std::vector<SeenPoint> seen, double loss_scale, std::size_t dense_up_to = 400);

  void hold_rotation(std::size_t view);
  void hold_center(std::size_t view, int axis);

  /// From where the state is. The same bits for any number of threads.
  TrustRegionEnd solve(int max_iterations, double cost_tolerance);

  const State& state() const { return state_; }

  /// One standard deviation of each lens' fx, all else being as uncertain as it is; none where fx
  /// is held, no view has the lens, or the normal equations are singular.
  std::vector<std::optional<double>> focal_sigmas() const;

 private:
  struct Problem;

  State state_;
  std::vector<int> lens_of_;
  std::vector<LensBelief> beliefs_;
  std::vector<SeenPoint> seen_;
  std::vector<std::size_t> first_seen_;  ///< of each point, and the end
  std::vector<std::vector<bool>> held_;  ///< of each node: views, then lenses
  double loss_scale_;
  std::size_t dense_up_to_;
  std::size_t parts_;  ///< sums are made of, whatever the number of threads
  /// Of a pair of nodes, the larger first, the place of its block; -1: no point joins them.
  std::vector<int> block_at_;
  int blocks_ = 0;
};

}  // namespace orbitfuse
