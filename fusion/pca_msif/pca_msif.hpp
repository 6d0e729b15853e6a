// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pca_msif/smoother.hpp"

// PCA-MSIF: base and detail by fourth-order diffusion, details weighted by the principal component
// of their covariance, bases averaged (Bavirisetti, Xiao, Liu 2017, "Multi-sensor image fusion
// based on fourth order partial differential equations").
namespace orbitfuse::fusion {

struct PcaMsifOptions {
  SmootherOptions smoother;
  Status validate() const { return smoother.validate(); }
};

/// Weights of two planes: the first eigenvector of their 2x2 covariance, scaled to sum 1 (both
/// parts positive). Without variance (rank 0) both are 1/2; opposite planes, whose eigenvector has
/// mixed signs, share by their standard deviations.
cv::Vec2d pca_weights(const Plane& a, const Plane& b);

struct PcaMsifReport {
  cv::Vec2d weights;     ///< visible, thermal
  bool skipped = false;  ///< the images are identical: returned as they are
};

/// Errors: check_pair's, usage.
Result<Plane> fuse_pca_msif(const Plane& visible, const Plane& thermal,
                            const PcaMsifOptions& options, PcaMsifReport* report = nullptr);

}  // namespace orbitfuse::fusion
