// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace orbitfuse {

/// SIFT descriptors of one image, a row of 128 each: COLMAP's bytes, 512 times a unit vector.
using Descriptors = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

using FeatureMatch = std::pair<int, int>;  ///< row in the first image, row in the second

struct DescriptorMatchOptions {
  /// Lowe's test, on angles as COLMAP does; its defaults.
  double max_ratio = 0.8;
  double max_distance_rad = 0.7;
};

/// Which feature of the second image may match one of the first: those within a band about its
/// epipolar line. Rays are undistorted, z = 1.
struct EpipolarBand {
  Eigen::Matrix3d essential;  ///< second^T E first = 0
  Eigen::Matrix3Xd first_rays, second_rays;
  double half_width = 0;  ///< in the second image's normalised plane

  /// The line of a feature of the first image, its normal's length 1.
  Eigen::Vector3d line_of(Eigen::Index first) const;
  /// Distance of a feature of the second image from the line of one of the first.
  double distance(Eigen::Index first, Eigen::Index second) const;
};

/// Mutual nearest neighbours that pass both tests, ordered by the first image's row; a tie goes to
/// the lower row. Exact, unlike COLMAP's forest of random trees: whole numbers below 2^24 add up in
/// float without rounding, so the answer depends on neither order, instruction set nor threads.
std::vector<FeatureMatch> match_descriptors(const Descriptors& first, const Descriptors& second,
                                            const DescriptorMatchOptions& options = {});

/// The same among the pairs of features that the band admits, where the poses are known: the
/// runner-up of Lowe's test too must lie on the line, so that repeated structure matches as well.
std::vector<FeatureMatch> match_in_band(const Descriptors& first, const Descriptors& second,
                                        const EpipolarBand& band,
                                        const DescriptorMatchOptions& options = {});

}  // namespace orbitfuse
