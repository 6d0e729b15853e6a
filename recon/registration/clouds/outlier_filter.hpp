// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/registration/similarity.hpp"

namespace orbitfuse::registration {

/// Drops scattered points where two populations of neighbour distances are seen; returns the
/// points unchanged where there is one population only.
Points without_outliers(const Points& points);

}  // namespace orbitfuse::registration
