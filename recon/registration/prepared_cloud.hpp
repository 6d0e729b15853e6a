// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/point_cloud.hpp"
#include "recon/registration/nearest_grid.hpp"
#include "recon/registration/register.hpp"
#include "recon/registration/similarity.hpp"

namespace orbitfuse::registration {

/// A cloud as the search uses it: finite points only, outliers dropped, centred and scaled to a
/// robust radius of 1 (unit_from_cloud), evenly thinned, with normals.
struct PreparedCloud {
  Similarity3d unit_from_cloud;
  Points points;
  Points normals;              ///< unit length; away from the centre
  std::vector<double> planarity;  ///< 0..1: how far the normal can be trusted
  NearestGrid nearest;
  std::size_t dropped_not_finite = 0, dropped_outliers = 0;
};

Result<PreparedCloud> prepare(const PointCloud& cloud, const RegistrationOptions& options, const std::string& name);

}  // namespace orbitfuse::registration
