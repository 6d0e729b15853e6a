// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

#include "app/stages/run_config.hpp"
#include "app/stages/session_input.hpp"

namespace orbitfuse::planning {

/// What a run's time and errors depend on, as far as it can be seen before anything has run.
struct SceneFacts {
  int visible_views = 0, thermal_views = 0;
  bool visible_posed = false, thermal_posed = false;  ///< the session carries the poses
  /// Frames are held out, of the thermal ones their temperatures.
  bool visible_measured = true, thermal_measured = true;
  double visible_height_by_width = 0.75, thermal_height_by_width = 0.8;
  int depth_width_px = 280;  ///< of the visible views' depth maps
  int new_views = 8;
  double new_view_mpx = 0.3;  ///< mean
  int detail_sources = 4;     ///< recorded views that lend a new one detail
  int fusion_methods = 5;
  /// PSNR of the photos against themselves at 100 pixels' width: how little detail there is.
  double smoothness_db = 28;
};

nlohmann::json to_json(const SceneFacts& facts);

/// Looks at every fourth photo. Error: one of them or the file of given cameras can't be read.
Result<SceneFacts> look_at(const stages::SessionInput& input, const stages::RunConfig& config);

}  // namespace orbitfuse::planning
