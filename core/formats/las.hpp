// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/geometry/point_cloud.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// LAS 1.4 (ASPRS R15), point format 7: colours, and temperatures in kelvin as extra bytes (float
/// "temperature", NaN = none). Positions are integers of the finest power of ten that holds the
/// cloud, at least a millionth of the unit. No coordinate system: the points lie in a frame of
/// their own. Errors: input (no point, or one that is not finite), device.
Status write_las(const std::filesystem::path& path, const PointCloud& cloud);

}  // namespace orbitfuse
