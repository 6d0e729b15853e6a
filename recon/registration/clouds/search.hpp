// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "core/progress.hpp"
#include "recon/registration/clouds/candidate.hpp"
#include "recon/registration/clouds/refine.hpp"
#include "recon/registration/clouds/score.hpp"

namespace orbitfuse::registration {

/// Instead of a number of points: a subset of them all.
inline constexpr int all_points = std::numeric_limits<int>::max();

/// The two clouds and what the options mean in their unit frames.
struct Search {
  const PreparedCloud& source;
  const PreparedCloud& target;
  const RegistrationOptions& options;
  ScoreBounds coarse;  ///< ranks what is refined in brief
  ScoreBounds fine;    ///< the report's score

  Search(const PreparedCloud& source, const PreparedCloud& target,
         const RegistrationOptions& options);

  /// As strict as the clouds are clean: the best placement's residuals are noise.
  ScoreBounds strict(double sigma) const;
  Refined refine_with(const Similarity3d& start, int points, const RefineOptions& how) const;
  Refined measured_at(const Similarity3d& placement, int points, const RefineOptions& how) const;
  /// Zero for placements outside the options' scales.
  Agreement agree(const Similarity3d& placement, int points, const ScoreBounds& bounds) const;
};

struct Found {
  Candidates ranked;  ///< best first by evidence, refined; may be empty
  std::vector<Skip> skips;
};
/// Both initialisers, the second where the first is not decisive.
Result<Found> find_placements(const Search& search, const Progress& progress);

}  // namespace orbitfuse::registration
