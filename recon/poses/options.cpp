// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate_poses.hpp"

#include <cmath>
#include <fmt/format.h>

namespace orbitfuse {
namespace {

Status check_range(const char* field, double value, double low, double high) {
  if (value >= low && value <= high) return {};  // false for NaN
  return fail(ErrorKind::usage, fmt::format("poses.{}", field), fmt::format("{}", value),
              fmt::format("give a value from {} to {}", low, high));
}

}  // namespace

Status PoseOptions::validate() const {
  if (colmap.empty())
    return fail(ErrorKind::usage, "poses.colmap", "empty", "give COLMAP's command, e.g. colmap");
  ORBITFUSE_TRY(check_range("threads", threads, 0, 1024));
  ORBITFUSE_TRY(check_range("max_image_side_px", max_image_side_px, 100, 20000));
  ORBITFUSE_TRY(check_range("max_features", max_features, 100, 100000));
  ORBITFUSE_TRY(check_range("min_posed_ratio", min_posed_ratio, 0.0, 1.0));
  ORBITFUSE_TRY(check_range("max_reprojection_rms_px", max_reprojection_rms_px, 0.1, 100.0));
  return check_range("max_station_residual", max_station_residual, 0.01, 10.0);
}

}  // namespace orbitfuse
