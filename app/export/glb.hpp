// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/geometry/triangle_mesh.hpp"
#include "core/result.hpp"

namespace orbitfuse::exporting {

/// Binary glTF 2.0 of one mesh: POSITION, NORMAL, COLOR_0 (linear, 16 bits) and `_TEMPERATURE`
/// (float, kelvin; 0 = none, because glTF allows no NaN), shown as it is (KHR_materials_unlit).
/// The mesh's z is up; the file's y is, as glTF has it: (x, y, z) becomes (x, z, -y). `extras` goes
/// to the asset and the mesh. `scalars` become attributes of their names ("_DIFFERENCE"), 0 where
/// they are not finite. Errors: input (an empty mesh, a position that is not finite, scalars that
/// are not one a vertex), device.
Status write_glb(const std::filesystem::path& path, const TriangleMesh& mesh,
                 const nlohmann::json& extras, const std::vector<VertexScalar>& scalars = {});

/// Positions (z up again), colours, temperatures (NaN = none) and triangles of a file of write_glb.
/// Errors: input (no such file, cut, or not laid out as write_glb's are).
Result<TriangleMesh> read_glb(const std::filesystem::path& path);

}  // namespace orbitfuse::exporting
