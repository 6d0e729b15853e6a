// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// Wavefront OBJ with normals and, after each position, its colour as most readers take it
/// (`v x y z r g b`, 0..1). OBJ has no place for temperatures. `comments`: lines at the beginning.
/// Errors: device.
Status write_obj(const std::filesystem::path& path, const TriangleMesh& mesh,
                 const std::vector<std::string>& comments);

}  // namespace orbitfuse
