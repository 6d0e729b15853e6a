// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/geometry/transform.hpp"

namespace orbitfuse::registration {

/// A place the search proposes, between the unit frames of the two clouds.
struct Candidate {
  Similarity3d target_from_source;
  double score = 0;      ///< what ranks it: coarse agreement in the search, evidence at the end
  double agreement = 0;  ///< at the end: Agreement::score with the report's bounds
  std::string origin = {};
  std::optional<double> residual_sigma = {};  ///< of its full refinement, if that had enough pairs
  bool refined = false;                       ///< fully: needs no other
};
using Candidates = std::vector<Candidate>;

/// Whether two placements of a cloud of radius 1 differ by more than refinement could bridge.
inline bool distinct(const Similarity3d& a, const Similarity3d& b, double rotation_deg = 8) {
  return rotation_angle_deg(a.rotation, b.rotation) > rotation_deg ||
         std::abs(std::log(a.scale / b.scale)) > 0.1 ||
         (a.translation - b.translation).norm() > 0.15 * std::max(a.scale, b.scale);
}

/// Best first, at most `most`, none close to a better one.
Candidates best_distinct(Candidates candidates, std::size_t most);

}  // namespace orbitfuse::registration
