// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"
#include "recon/nerf/dataset.hpp"

namespace orbitfuse::bench {

/// "fox" (270x480, every 8th view measures), or ORBIT[-thermal][-sector][-full]: an orbit with a
/// ground_truth.json (a folder in `data`, or a path with a slash), exact poses, its test views
/// measure. Visible images are 400 pixels wide unless "-full"; "-sector" keeps the views, of both
/// kinds, in 125 degrees of azimuth. `model` (may be empty) is a COLMAP model whose points are
/// used.
Result<nerf::Dataset> load_scene(const std::string& name, const std::filesystem::path& data,
                                 const std::filesystem::path& model);

}  // namespace orbitfuse::bench
