// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/register_fields.hpp"

#include <algorithm>

#include "recon/registration/similarity_search.hpp"

namespace orbitfuse {
namespace {

/// What the clouds leave open, to be searched by the images: twice what their restarts spread by,
/// beyond which a start belongs to another answer.
SimilaritySearchOptions left_open(const RegistrationReport& clouds) {
  constexpr double widest_turn_deg = 15, widest_growth = 0.15;
  SimilaritySearchOptions options;
  options.turn_deg = std::clamp(2 * clouds.spread_rotation_deg, options.turn_deg, widest_turn_deg);
  options.growth = std::clamp(2 * clouds.spread_scale_percent / 100, options.growth, widest_growth);
  options.clouds_decide = !clouds.ambiguous;
  return options;
}

}  // namespace

Result<FieldRegistration> register_fields(const ThermalEvidence& thermal,
                                          const VisibleEvidence& visible,
                                          const RegistrationOptions& options,
                                          const Progress& progress) {
  Status views_failed;
  const ViewScore explained = [&](const Similarity3d& visible_from_thermal) {
    const auto support = similarity_support(visible.renderer, thermal.images, thermal.views,
                                            visible_from_thermal, progress);
    if (!support) views_failed = tl::unexpected(support.error());
    return support ? *support : 0.0;
  };
  FieldRegistration result;
  ORBITFUSE_ASSIGN(result.clouds,
                   register_clouds(thermal.cloud, visible.cloud, options, progress, explained));
  ORBITFUSE_TRY(views_failed);
  ORBITFUSE_ASSIGN(result.images, search_similarity(visible.renderer, thermal.images, thermal.views,
                                                    result.clouds.target_from_source,
                                                    left_open(result.clouds), progress));
  return result;
}

}  // namespace orbitfuse
