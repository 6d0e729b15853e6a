// SPDX-License-Identifier: BSD-3-Clause
#include "app/comparison/comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/stages/stage_list.hpp"
#include "core/formats/ply.hpp"
#include "core/numeric/median.hpp"
#include "core/option_range.hpp"
#include "recon/assembly/field_renderer.hpp"
#include "recon/surface/mesh_regions.hpp"

namespace orbitfuse::comparison {
namespace {

constexpr double sigma_of_median = 1.4826;  // of a normal distribution
constexpr double noise_sigmas = 3;          // a difference that noise alone would not make
/// Two clouds of one object, apart by what moved, agree at least so well.
constexpr double least_score = 0.3, least_agreement = 0.1;

Status has_what_it_takes(const view::FinishedRun& run) {
  if (!run.has(Modality::visible) || !run.has(Modality::thermal))
    return fail(ErrorKind::input, run.out.string(),
                run.has(Modality::visible) ? "no thermal field" : "no visible field",
                "compare needs both of each run: orbitfuse run");
  if (run.thermal_is_gray)
    return fail(ErrorKind::input, run.out.string(), "thermal images of gray levels",
                "differences of temperature need radiometric images");
  return {};
}

/// The visible field as its own cameras see it: edges that the other field must show too. The
/// recorded photos would do as well, and need not be there any more.
Result<ThermalEvidence> evidence_of(const view::FinishedRun& run, const Progress& progress) {
  ThermalEvidence evidence;
  ORBITFUSE_ASSIGN(evidence.cloud,
                   read_ply(run.out / "train_visible" / stages::cloud_file));
  const SceneRenderer renderer = edge_renderer(run.visible, progress);
  constexpr int width_px = 320;
  for (PosedView view : fields_of(run).visible_views) {
    ORBITFUSE_TRY(progress.check("compare"));
    const int width = std::min(width_px, view.camera.width);
    view.camera = view.camera.scaled_to(width, std::max(1, view.camera.height * width /
                                                               view.camera.width))
                      .without_distortion();
    ORBITFUSE_ASSIGN(const SceneRender seen, renderer(view.camera, view.cam_from_world));
    evidence.images.push_back(seen.brightness);
    evidence.views.push_back(std::move(view));
  }
  return evidence;
}

/// Where BEFORE's world lies in AFTER's, by what both visible fields show: clouds first, edges then.
Result<FieldRegistration> registered(const view::FinishedRun& before,
                                     const view::FinishedRun& after,
                                     const RegistrationOptions& options,
                                     const Progress& progress) {
  ORBITFUSE_ASSIGN(const ThermalEvidence earlier, evidence_of(before, progress));
  ORBITFUSE_ASSIGN(PointCloud cloud,
                   read_ply(after.out / "train_visible" / stages::cloud_file));
  const VisibleEvidence later{std::move(cloud), edge_renderer(after.visible, progress)};
  ORBITFUSE_ASSIGN(FieldRegistration found, register_fields(earlier, later, options, progress));
  if (found.clouds.score < least_score || found.images.agreement_after < least_agreement)
    return fail(ErrorKind::quality, before.out.string() + " and " + after.out.string(),
                fmt::format("surfaces that agree at {:.2f} (at least {:.2f} is asked) and edges "
                            "at {:.2f} ({:.2f})",
                            found.clouds.score, least_score, found.images.agreement_after,
                            least_agreement),
                "see that both are of one object, seen from all round");
  return found;
}

double percentile_of_size(std::vector<float> values, double share) {
  std::sort(values.begin(), values.end(),
            [](float a, float b) { return std::abs(a) < std::abs(b); });
  return static_cast<double>(
      values[std::min(values.size() - 1,
                      static_cast<std::size_t>(share * static_cast<double>(values.size())))]);
}

/// The surface that did not change: its middle and its scatter.
Status settle(const std::vector<double>& areas, const CompareOptions& options, Comparison& c) {
  std::vector<double> known;
  double total = 0;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    total += areas[v];
    const SurfaceChange change = c.difference.change[v];
    (change == SurfaceChange::same      ? c.same_share
     : change == SurfaceChange::changed ? c.changed_share
                                        : c.unseen_share) += areas[v];
    if (change == SurfaceChange::same)
      known.push_back(static_cast<double>(c.difference.difference_k[v]));
  }
  constexpr std::size_t least_vertices = 100;
  if (known.size() < least_vertices || !(total > 0))
    return fail(ErrorKind::quality, "compare", "hardly any surface that both runs saw",
                "see that both are of one object and went round it");
  c.ambient_k = median(known);
  for (std::size_t v = 0; v < areas.size(); ++v)
    if (std::abs(static_cast<double>(c.difference.difference_k[v]) - c.ambient_k) > options.least_k)
      c.beyond_share += areas[v] / c.same_share;
  for (double* share : {&c.same_share, &c.changed_share, &c.unseen_share}) *share /= total;
  for (double& k : known) k = std::abs(k - c.ambient_k);
  c.noise_k = sigma_of_median * median(known);
  c.ambient_removed = options.without_ambient;
  if (c.ambient_removed)
    for (float& k : c.difference.difference_k) k -= static_cast<float>(c.ambient_k);
  return {};
}

std::vector<ComparedRegion> warmer_or_colder(const std::vector<double>& areas, double total,
                                             const CompareOptions& options, const Comparison& c) {
  const TriangleMesh& mesh = c.surface.mesh;
  const double middle = c.ambient_removed ? 0 : c.ambient_k;
  const double least = std::max(options.least_k, noise_sigmas * c.noise_k);
  std::vector<int> labels;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    const double beyond = static_cast<double>(c.difference.difference_k[v]) - middle;
    // Where views disagree by more than the difference, it is none that can be stated.
    const bool stated = std::abs(beyond) > std::max(least, static_cast<double>(c.difference.spread_k[v]));
    labels.push_back(!stated ? 0 : beyond > 0 ? 1 : -1);
  }
  std::vector<ComparedRegion> found;
  for (const MeshRegion& region : connected_regions(mesh, labels)) {
    if (region.area < options.least_area_share * total) continue;
    ComparedRegion r{region.center, region.area, region.vertices.size(), 0, 0, 0};
    std::vector<float> values;
    double spread = 0;
    for (const std::uint32_t v : region.vertices) {
      const double share = areas[v] / region.area;
      r.mean_k += share * static_cast<double>(c.difference.difference_k[v]);
      spread += share * std::pow(static_cast<double>(c.difference.spread_k[v]), 2);
      values.push_back(c.difference.difference_k[v]);
    }
    r.peak_k = percentile_of_size(std::move(values), 0.95);
    r.uncertainty_k = std::sqrt(spread + c.noise_k * c.noise_k);
    found.push_back(r);
  }
  std::stable_sort(found.begin(), found.end(), [&](const auto& a, const auto& b) {
    return std::abs(a.mean_k - middle) > std::abs(b.mean_k - middle);
  });
  if (static_cast<int>(found.size()) > options.most_regions)
    found.resize(static_cast<std::size_t>(options.most_regions));
  return found;
}

/// Where a surface is that the other run saw through.
std::vector<ComparedRegion> changed_regions(const TriangleMesh& mesh,
                                            const SurfaceDifference& difference, double total,
                                            const CompareOptions& options) {
  std::vector<int> labels;
  for (const SurfaceChange change : difference.change)
    labels.push_back(change == SurfaceChange::changed ? 1 : 0);
  std::vector<ComparedRegion> found;
  for (const MeshRegion& region : connected_regions(mesh, labels)) {
    if (region.area < options.least_area_share * total ||
        static_cast<int>(found.size()) >= options.most_regions)
      break;  // the largest come first
    found.push_back({region.center, region.area, region.vertices.size(), 0, 0, 0});
  }
  return found;
}

}  // namespace

Status CompareOptions::validate() const {
  const OptionCheck check("compare");
  ORBITFUSE_TRY(check("least_k", least_k, above(0)));
  ORBITFUSE_TRY(check("least_area_share", least_area_share, between(0, 1)));
  ORBITFUSE_TRY(check("most_regions", most_regions, at_least(1)));
  ORBITFUSE_TRY(surface.surface.validate());
  ORBITFUSE_TRY(difference.validate());
  return registration.validate();
}

SurfaceFields fields_of(const view::FinishedRun& run) {
  SurfaceFields fields;
  if (run.has(Modality::visible)) fields.visible = &run.visible;
  if (run.has(Modality::thermal)) fields.thermal = &run.thermal;
  fields.world_from_thermal = run.frame_from_thermal;
  for (const view::RecordedView& v : run.views)
    if (!v.doubt)
      (v.modality == Modality::visible ? fields.visible_views : fields.thermal_views)
          .push_back(v.view);
  return fields;
}

Result<Comparison> compare_runs(const view::FinishedRun& before, const view::FinishedRun& after,
                                const CompareOptions& options, const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(has_what_it_takes(before));
  ORBITFUSE_TRY(has_what_it_takes(after));
  Comparison c;
  ORBITFUSE_ASSIGN(c.registration, registered(before, after, options.registration, progress));
  const Similarity3d& after_from_before = c.registration.visible_from_thermal();
  const SurfaceFields earlier = fields_of(before), later = fields_of(after);

  ORBITFUSE_ASSIGN(c.surface, exporting::surface_of_run(after, options.surface, progress));
  ORBITFUSE_ASSIGN(const std::vector<DifferencePicture> pictures,
                   difference_pictures(later, earlier, after_from_before, options.difference,
                                       progress));
  ORBITFUSE_ASSIGN(c.difference, surface_difference(c.surface.mesh, pictures, options.difference,
                                                    progress));
  const std::vector<double> areas = vertex_areas(c.surface.mesh);
  ORBITFUSE_TRY(settle(areas, options, c));
  double total = 0;
  for (const double area : areas) total += area;
  c.warmer_or_colder = warmer_or_colder(areas, total, options, c);
  c.appeared = changed_regions(c.surface.mesh, c.difference, total, options);

  // The same the other way round: what stood there and is gone.
  ORBITFUSE_ASSIGN(const FieldSurface old,
                   exporting::surface_of_run(before, options.surface, progress));
  ORBITFUSE_ASSIGN(const SurfaceDifference back,
                   surface_difference(old.mesh, seen_from_other(pictures, after_from_before),
                                      options.difference, progress));
  const double scale = after_from_before.scale;
  c.gone = changed_regions(old.mesh, back, total / (scale * scale), options);
  for (ComparedRegion& region : c.gone) {
    region.center = after_from_before * region.center;
    region.area *= scale * scale;
  }
  return c;
}

}  // namespace orbitfuse::comparison
