// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "core/geometry/camera.hpp"
#include "recon/alignment/patch_matching.hpp"
#include "recon/alignment/pose_correction.hpp"

// Corrections of poses and of their common lens from patches found in images: robust least squares
// by Levenberg and Marquardt, what several views share eliminated first (Triggs et al., Bundle
// adjustment - a modern synthesis, 2000). Ceres does the same for any problem, on one thread where
// sums must not depend on their number; this one problem took it ten times as long.
namespace orbitfuse {

/// A place of the scene, on its surface but not quite, that several views show.
struct SharedPlace {
  struct Sighting {
    std::size_t view = 0;
    Eigen::Vector3d point;           ///< of the surface, in the camera's axes before the correction
    Eigen::Matrix3d cam_from_world;  ///< rotation: the place's offset is the world's
    Eigen::Vector2d pixel;           ///< where it was found
    Eigen::Matrix2d sqrt_weight;
  };
  Eigen::Vector3d sight;  ///< world, unit: the direction along which the surface holds it
  double sigma = 1;       ///< of that hold
  std::vector<Sighting> sightings;
};

/// Cauchy scales, pixels: where a residual begins to count less.
struct PoseBundleLosses {
  double edge_px = 1, sighting_px = 1;
};

/// What is believed of the lens; a sigma of 0: it stays as it is.
struct CommonLensPrior {
  ValuePrior log_focal{0, 0}, radial{0, 0};
};

class PoseBundle {
 public:
  /// `camera`: of all views, without distortion of its own.
  PoseBundle(const Camera& camera, std::size_t views);

  /// A patch of the known scene found in a view; its residual's part of the cost is scaled.
  void add(std::size_t view, const PatchMatch& match, double weight);
  void add(SharedPlace place);
  /// The view stays where it is; what it shows still holds the others.
  void hold(std::size_t view) { held_[view] = true; }

  /// From where the corrections and the lens are. False where no usable answer is found (a place
  /// behind its camera at the start, nothing finite). Views that nothing holds stay. The same bits
  /// for any number of threads.
  bool solve(const CommonLensPrior& lens, const PoseBundleLosses& losses, int max_iterations);

  const std::vector<PoseCorrection>& corrections() const { return state_.corrections; }
  double log_focal() const { return state_.lens[0]; }
  double radial() const { return state_.lens[1]; }  ///< k1

  /// Weighted pixels between where a place is now and where it was found, of each place's
  /// sightings; not a number behind the camera.
  std::vector<std::vector<double>> sighting_residuals_px() const;

 private:
  struct State {
    std::vector<PoseCorrection> corrections;
    std::array<double, 2> lens{0, 0};      ///< log_focal, radial
    std::vector<Eigen::Vector3d> offsets;  ///< of the places from the surface, world
  };
  struct WeightedMatch {
    PatchMatch match;
    double weight;
  };
  struct LinearPlace;
  struct Linear;
  struct Reduced;
  struct Step;
  struct Problem;

  bool linearise(const State& at, const CommonLensPrior& lens, const PoseBundleLosses& losses,
                 Linear& linear) const;
  Reduced views_alone(const Linear& linear, double radius) const;
  void eliminate(std::size_t index, const LinearPlace& place, const Reduced& reduced,
                 Eigen::MatrixXd& h, Eigen::VectorXd& g) const;
  void eliminate_places(const Linear& linear, double radius, Reduced& reduced) const;
  Step step(const Linear& linear, double radius) const;
  State moved(const State& from, const Step& step) const;

  Camera camera_;
  std::vector<bool> held_;                           ///< views
  std::vector<std::vector<WeightedMatch>> matches_;  ///< of each view
  std::vector<SharedPlace> places_;
  State state_;
};

}  // namespace orbitfuse
