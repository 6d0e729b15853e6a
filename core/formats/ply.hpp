// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/geometry/point_cloud.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// ASCII or binary PLY vertices: x y z, nx ny nz, red green blue, temperature (kelvin). Other
/// properties and elements are skipped. Positions that are not finite, or
/// beyond 1e9, are kept as NaN (callers decide).
Result<PointCloud> read_ply(const std::filesystem::path& path);

/// Binary little-endian.
Status write_ply(const std::filesystem::path& path, const PointCloud& cloud);

}  // namespace orbitfuse
