// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"
#include "core/json_fields.hpp"
#include "core/result.hpp"

// Cameras and transforms as this project writes them into JSON (session, depth maps, registration);
// other programs' files have names of their own (core/formats).
namespace orbitfuse {

/// {"width", "height", "fx", "fy", "cx", "cy"} in pixels.
nlohmann::json pinhole_json(const Camera& camera);
/// The same with the lens' "k1", "k2", "p1", "p2".
nlohmann::json camera_json(const Camera& camera);
/// Either of the two. Error: a field is missing or no camera's.
Result<Camera> camera_of_json(const JsonFields& fields);

/// {"rotation_wxyz", "translation"}; with "scale".
nlohmann::json rigid_json(const Rigid3d& a_from_b);
nlohmann::json similarity_json(const Similarity3d& a_from_b);
/// Error: a field is missing, the rotation is no unit quaternion (by more than rounding), or the
/// scale is not above 0.
Result<Rigid3d> rigid_of_json(const JsonFields& fields);
Result<Similarity3d> similarity_of_json(const JsonFields& fields);

/// Four rows of four.
nlohmann::json matrix_json(const Eigen::Matrix4d& matrix);
/// Nothing where it is not four lists of four numbers; they may be of any size.
std::optional<Eigen::Matrix4d> matrix_of_json(const nlohmann::json& rows);

}  // namespace orbitfuse
