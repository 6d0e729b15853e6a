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

/// Mutual nearest neighbours that pass both tests, ordered by the first image's row; a tie goes to
/// the lower row. Exact, unlike COLMAP's forest of random trees: whole numbers below 2^24 add up in
/// float without rounding, so the answer depends on neither order, instruction set nor threads.
std::vector<FeatureMatch> match_descriptors(const Descriptors& first, const Descriptors& second,
                                            const DescriptorMatchOptions& options = {});

}  // namespace orbitfuse
