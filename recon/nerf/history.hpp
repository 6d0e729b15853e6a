// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace orbitfuse::nerf {

/// One point of the error-against-time curve.
struct CurvePoint {
  double cpu_s = 0, wall_s = 0;  ///< spent training, evaluation excluded
  std::int64_t step = 0;         ///< as wide as the others: stored as it lies, without padding
  double heldout_psnr = 0;       ///< dB; NaN without held-out views
  double train_psnr = 0;         ///< dB, running mean over recent steps
  double samples_per_ray = 0;
};

/// What a run has been through, over all its parts if it was interrupted or extended.
struct History {
  std::vector<CurvePoint> curve;
  int skipped_steps = 0;  ///< steps dropped because a gradient was not finite
  long rays = 0, samples = 0;
  double cpu_s = 0, wall_s = 0;  ///< spent training, evaluation excluded
  double samples_per_ray() const {
    return rays > 0 ? static_cast<double>(samples) / static_cast<double>(rays) : 0.0;
  }
};

/// The views a field learns from, to tell whether it may go on with a dataset.
struct ViewRecord {
  std::string name;
  bool heldout = false;
  std::string hash;  ///< of image, camera and pose
};

}  // namespace orbitfuse::nerf
