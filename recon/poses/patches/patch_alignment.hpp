// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>

#include "core/result.hpp"

// Where a small piece of one image lies in another, to a tenth of a pixel: descriptors find the
// same surface, but their centres scatter by half a pixel between views that look 30 degrees apart.
// Inverse compositional alignment by an affine warp (S. Baker and I. Matthews, Lucas-Kanade 20
// Years On, IJCV 2004); brightness and contrast of the two are free.
namespace orbitfuse {

/// Pixels count from the centre of the first, which is 0.
struct PatchPlace {
  Eigen::Vector2d centre;
  Eigen::Matrix2d linear;  ///< of a step in the template's image, the step in this one
};

struct PatchOptions {
  int radius_px = 8;             ///< of the square template, about its centre
  double window_sigma_px = 4.5;  ///< of a sample's weight, by its distance from the centre
  int max_iterations = 20;
  double converged_px = 0.005;
  /// Levenberg's damping of the affine part, at a pixel of the rim, as a share of what a shift
  /// costs: where little texture holds it, a step would turn and shear the patch out of reach.
  double affine_damping = 0.015;

  Status validate() const;
};

struct AlignedPatch {
  PatchPlace place;
  double correlation = 0;  ///< -1 to 1, weighted, brightness and contrast free
  /// Of the centre along its worse direction, in this image's pixels, by what is left unexplained.
  double sigma_px = 0;
};

/// A patch of one image, to be found in others. Images are CV_32FC1, of any scale; NaN is unknown.
class PatchTemplate {
 public:
  /// None where the patch leaves the image, holds a NaN or is constant along a direction.
  static std::optional<PatchTemplate> at(const cv::Mat& image, const Eigen::Vector2d& centre,
                                         const PatchOptions& options);

  /// From near its place there. None where it leaves the image, meets a NaN or its centre comes to
  /// no rest.
  std::optional<AlignedPatch> align(const cv::Mat& image, const PatchPlace& start) const;

 private:
  /// Shift by x and y, then the linear part by rows.
  using Affine = Eigen::Matrix<double, 6, 1>;
  using AffineRows = Eigen::Matrix<double, 6, Eigen::Dynamic>;
  using Normal = Eigen::Matrix<double, 6, 6>;

  explicit PatchTemplate(const PatchOptions& options);
  /// False where nothing holds the patch in a direction.
  bool set_gradient(const Eigen::Matrix2Xd& gradient);
  double sigma_px(const AlignedPatch& patch) const;

  PatchOptions options_;
  Eigen::Matrix2Xd steps_;   ///< of the samples from the centre
  Eigen::VectorXd weights_;  ///< sum 1
  Eigen::VectorXd values_;   ///< weighted mean 0 and square sum 1
  AffineRows descent_;       ///< weighted, without what brightness and contrast explain
  Normal inverse_normal_;
};

}  // namespace orbitfuse
