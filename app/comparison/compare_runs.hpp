// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/stages/metric_scale.hpp"
#include "app/view/finished_run.hpp"
#include "recon/assembly/field_surface.hpp"
#include "recon/comparison/difference_regions.hpp"
#include "recon/comparison/register_surfaces.hpp"

namespace orbitfuse::comparing {

struct CompareRequest {
  comparison::ComparisonOptions options;
  int triangles = 60'000;  ///< of each surface: every vertex is read in all frames of both runs
  bool ambient = false;    ///< take out what both days differ by as a whole
};

/// Shares of AFTER's surface, by area; together 1.
struct SurfaceShares {
  double compared = 0, changed = 0, not_seen = 0, without_temperature = 0;
};

/// Both runs, and all that differs.
struct ComparedRuns {
  view::FinishedRun before, after;
  FieldSurface before_surface, after_surface;  ///< each in its run's world
  comparison::SurfaceRegistration registration;
  double support = 0;                               ///< of AFTER's photos by renders of BEFORE
  std::vector<comparison::SurfaceChange> change;    ///< a vertex of AFTER's surface
  std::vector<comparison::PointDifference> points;  ///< likewise, before anything was taken out
  double common_k = 0;  ///< median difference of what holds still; NaN: nothing was compared
  double taken_k = 0;   ///< common_k with CompareRequest::ambient, else 0
  SurfaceShares shares;
  std::vector<comparison::DifferenceRegion> differences;
  std::vector<comparison::DifferenceRegion> came;  ///< of AFTER's surface: not there before
  std::vector<comparison::DifferenceRegion>
      gone;                                  ///< of BEFORE's, middle and place in AFTER's world
  std::optional<stages::MetricScale> scale;  ///< of AFTER's world, told in either run or both
  std::string scale_doubt;                   ///< why there is none although both runs have one
  double least_difference_k = 0;             ///< of a finding

  /// NaN where it is not known.
  double difference_k(std::size_t vertex) const { return points[vertex].difference_k - taken_k; }
};

/// Whether both folders hold what a comparison needs, without the comparison: whether they show one
/// object is not asked. Errors: input, as compare_runs (a damaged scale among them).
Status check_comparable(const std::filesystem::path& before, const std::filesystem::path& after,
                        const stages::RunConfig& config, const CompareRequest& request,
                        const Progress& progress);

/// Errors: input (a folder that is no finished run, without a visible or thermal field, without its
/// session, of gray levels; each named), quality (not one object, or not to be registered),
/// field_surface's, the measurement's, cancelled.
Result<ComparedRuns> compare_runs(const std::filesystem::path& before,
                                  const std::filesystem::path& after,
                                  const stages::RunConfig& config, const CompareRequest& request,
                                  const Progress& progress);

}  // namespace orbitfuse::comparing
