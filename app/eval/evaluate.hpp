// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/formats/ground_truth.hpp"
#include "core/progress.hpp"
#include "core/session/session.hpp"

namespace orbitfuse::eval {

struct EvaluateOptions {
  int max_width_px = 640;    ///< test views are compared at most at this width
  double scene_above_c = 0;  ///< temperatures below are sky, not scene
  double min_opacity = 0.5;  ///< of the thermal field, for the share of the scene it covers
};

/// Errors of a finished run against the truth. Poses: after a similarity fit of the camera centres
/// (Umeyama 1991). Thermal poses once by their own fit, and once in the visible frame, through the
/// registration, by the visible fit: that is the registration's error. Test views: both fields
/// rendered from the true cameras brought into the visible frame by the visible fit, so that pose
/// errors count. What a run did not make is absent from the result, with the reason in "notes"; in
/// "warnings" is why figures may rather tell of the truth.
Result<nlohmann::json> evaluate(const std::filesystem::path& out, const Session& session,
                                const GroundTruth& truth, const EvaluateOptions& options,
                                const Progress& progress);

}  // namespace orbitfuse::eval
