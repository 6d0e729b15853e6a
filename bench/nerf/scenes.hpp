// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"
#include "recon/nerf/dataset.hpp"

namespace orbitfuse::bench {

/// Named cases on the shared data: "fox" (270x480, every 8th view measures), "container" (visible,
/// exact poses, 24 train, the 8 test views measure, 400x300), "container-full" (the same at 800x600), "container-thermal" (exact poses, 24
/// train at 640x480, the 8 noise-free test views measure), "container-thermal-sector" (120 degrees).
/// `model` (may be empty) is a COLMAP model whose points are used (container).
Result<nerf::Dataset> load_scene(const std::string& name, const std::filesystem::path& data,
                                 const std::filesystem::path& model);

}  // namespace orbitfuse::bench
