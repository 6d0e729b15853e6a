// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/geometry/transform.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// Coordinates beyond this are damage: squares of them would lose every digit that matters.
inline constexpr double max_coordinate = 1e9;

/// cam_from_world of a camera-to-world matrix with OpenGL axes, as lists of 3 or 4 rows of 4. Input
/// error naming `where` unless it is finite, of coordinates that can be computed with, and rigid.
Result<Rigid3d> rigid_of_opengl_json(const nlohmann::json& rows, const std::string& where);

}  // namespace orbitfuse
