// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "recon/registration/clouds/prepared_cloud.hpp"

namespace orbitfuse::registration {

/// The points that carry descriptors: a coarser thinning of a cloud, with its normals.
struct FeaturePoints {
  Points points, normals;
};
FeaturePoints feature_points(const PreparedCloud& cloud, int wanted);

/// One column a point, unit length, 33 bins.
using Descriptors = Eigen::Matrix<float, 33, Eigen::Dynamic>;

/// Fast point feature histograms (Rusu et al. 2009) over a radius in the unit frame, with votes
/// shared between neighbouring bins, so that sampling moves a histogram little.
Descriptors describe(const FeaturePoints& cloud, double radius);

struct Match {
  int source, target;
  float distance;  ///< between descriptors
};
/// Pairs that are each other's nearest descriptor, the surest first; at most `most`.
std::vector<Match> mutual_matches(const Descriptors& source, const Descriptors& target, int most);

}  // namespace orbitfuse::registration
