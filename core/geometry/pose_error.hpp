// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// An estimated view and the true one.
struct PosePair {
  Rigid3d cam_from_estimate, cam_from_truth;
  std::string name = {};  ///< for the reader of PoseError::each
};

struct ViewError {
  std::string name;
  double center_percent = 0, outward_percent = 0;  ///< of the extent; along the true optical axis
  double rotation_deg = 0;
};

/// Errors of camera poses after a similarity has brought them into the frame of the truth.
struct PoseError {
  int views = 0;
  double ate_percent = 0;  ///< RMS distance of the centres, % of the extent
  double ate_median_percent = 0, ate_max_percent = 0;
  double rotation_mean_deg = 0, rotation_median_deg = 0, rotation_max_deg = 0;
  std::vector<ViewError> each;
};

/// The similarity that brings the estimated centres nearest to the true ones (Umeyama 1991).
/// Input error for fewer than three views or centres on a line: the fit is not determined.
Result<Similarity3d> truth_from_estimate(const std::vector<PosePair>& pairs);

/// The extent is the largest distance between two true camera centres of `pairs`.
PoseError pose_error(const std::vector<PosePair>& pairs, const Similarity3d& truth_from_estimate);

double extent_of_truth(const std::vector<PosePair>& pairs);

}  // namespace orbitfuse
