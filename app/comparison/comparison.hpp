// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/export/surface_files.hpp"
#include "app/stages/metric_scale.hpp"
#include "app/view/finished_run.hpp"
#include "recon/assembly/surface_difference.hpp"
#include "recon/assembly/register_fields.hpp"

// Two finished runs of one object, days apart: brought into one frame by their visible geometry,
// then compared surface by surface (recon/assembly/surface_difference.hpp).
namespace orbitfuse::comparison {

struct CompareOptions {
  bool without_ambient = false;  ///< the common difference is taken out
  double least_k = 1;            ///< a difference worth a line, beside three times the noise
  double least_area_share = 5e-4;  ///< of the surface: smaller regions are noise
  int most_regions = 20;           ///< lines of a table
  exporting::SurfaceRequest surface;
  SurfaceDifferenceOptions difference;
  RegistrationOptions registration;
  Status validate() const;
};

/// A connected part of the surface that has become warmer or colder, or is another one.
struct ComparedRegion {
  Eigen::Vector3d center;      ///< world of AFTER
  double area = 0;             ///< squared unit of AFTER
  std::size_t vertices = 0;
  double mean_k = 0;           ///< of the difference, area-weighted; ambient taken out if asked
  double peak_k = 0;           ///< 95th percentile of its size, with its sign
  double uncertainty_k = 0;    ///< one standard deviation of the mean
};

struct Comparison {
  FieldRegistration registration;   ///< BEFORE as the thermal, AFTER as the visible one
  FieldSurface surface;             ///< of AFTER, in its world
  SurfaceDifference difference;     ///< of its vertices
  double ambient_k = 0;             ///< median of the unchanged surface
  bool ambient_removed = false;
  double noise_k = 0;  ///< robust standard deviation of the unchanged surface about the ambient
  double same_share = 0, changed_share = 0, unseen_share = 0;  ///< of AFTER's area
  double beyond_share = 0;  ///< of the compared area: beyond least_k from the ambient
  std::vector<ComparedRegion> warmer_or_colder;  ///< the largest differences first
  std::vector<ComparedRegion> appeared;  ///< AFTER's surface where BEFORE saw through: area first
  std::vector<ComparedRegion> gone;      ///< BEFORE's surface, brought to AFTER's world
};

/// Errors: input (a run without thermal field, runs that are not of one object), the stages'.
Result<Comparison> compare_runs(const view::FinishedRun& before, const view::FinishedRun& after,
                                const CompareOptions& options, const Progress& progress);

/// What surfaces and pictures are made of.
SurfaceFields fields_of(const view::FinishedRun& run);

}  // namespace orbitfuse::comparison
