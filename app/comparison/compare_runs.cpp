// SPDX-License-Identifier: BSD-3-Clause
#include "app/comparison/compare_runs.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "app/export/surface_files.hpp"
#include "app/stages/measurement_scene.hpp"
#include "core/geometry/narrowed.hpp"
#include "core/image/image_io.hpp"
#include "core/image/undistorted.hpp"
#include "recon/assembly/field_renderer.hpp"
#include "recon/registration/similarity_refinement.hpp"

namespace orbitfuse::comparing {
namespace {
namespace fs = std::filesystem;
using comparison::SurfaceChange;

Result<view::FinishedRun> complete_run(const fs::path& out, const stages::RunConfig& config,
                                       const Progress& progress) {
  ORBITFUSE_ASSIGN(view::FinishedRun run, view::load_finished_run(out, config, progress));
  const std::string finish = "finish it: orbitfuse run " + out.string();
  if (!run.has(Modality::visible))
    return fail(ErrorKind::input, out.string(),
                "no visible field, by which runs are brought together", finish);
  if (!run.has(Modality::thermal))
    return fail(ErrorKind::input, out.string(), "no thermal field in the visible one's world",
                finish);
  if (!run.session)
    return fail(ErrorKind::input, out.string(), "its session is not where the run read it",
                "bring it back: temperatures are read from the recorded frames");
  if (run.thermal_is_gray)
    return fail(ErrorKind::input, out.string(), "gray levels, no temperatures",
                "compare runs of thermal frames that hold temperatures");
  return run;
}

Result<FieldSurface> surface_of(const view::FinishedRun& run, const CompareRequest& request,
                                const Progress& progress) {
  exporting::SurfaceRequest wanted;
  wanted.surface.surface.triangles = request.triangles;
  wanted.surface.depth_noise = true;
  return exporting::surface_of_run(run, wanted, progress);
}

constexpr int map_width_px = 400;

/// The visible cameras without distortion, small enough for depth maps.
std::vector<PosedView> small_views(const view::FinishedRun& run) {
  std::vector<PosedView> views;
  for (const view::RecordedView& v : run.views) {
    if (v.modality != Modality::visible) continue;
    views.push_back({v.view.name, narrowed_to(v.view.camera, map_width_px).without_distortion(),
                     v.view.cam_from_world});
  }
  return views;
}

/// Some visible photos as floats without distortion, with their cameras.
struct Photos {
  std::vector<PosedView> views;
  std::vector<cv::Mat> images;
};

Result<Photos> photos_of(const view::FinishedRun& run) {
  constexpr std::size_t most = 8;
  std::vector<const view::RecordedView*> visible;
  for (const view::RecordedView& v : run.views)
    if (v.modality == Modality::visible && !v.doubt) visible.push_back(&v);
  const std::size_t step = std::max<std::size_t>(1, (visible.size() + most - 1) / most);
  Photos photos;
  for (std::size_t i = 0; i < visible.size(); i += step) {
    const PosedView& posed = visible[i]->view;
    ORBITFUSE_ASSIGN(const cv::Mat image, read_visible(run.session->folder / posed.name));
    cv::Mat gray, as_float;
    if (image.channels() == 3)
      cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
    else
      gray = image;
    ORBITFUSE_ASSIGN(const cv::Mat straight, recorded_straight(gray, posed.camera, posed.name));
    straight.convertTo(as_float, CV_32F, 1 / 255.0);
    photos.views.push_back({posed.name, posed.camera.without_distortion(), posed.cam_from_world});
    photos.images.push_back(as_float);
  }
  if (photos.views.empty())
    return fail(ErrorKind::input, run.out.string(), "no visible view whose pose is sure",
                "run it again with more of the visible views");
  return photos;
}

/// Registers the surfaces and holds the result against AFTER's photos.
Status register_runs(const CompareRequest& request, const Progress& progress, ComparedRuns& runs) {
  ORBITFUSE_ASSIGN(const Photos photos, photos_of(runs.after));
  const SceneRenderer renderer = edge_renderer(runs.before.visible, progress);
  const auto support = [&](const Similarity3d& before_from_after) {
    return similarity_support(renderer, photos.images, photos.views, before_from_after, progress);
  };
  Status failed;
  const ViewScore score = [&](const Similarity3d& before_from_after) {
    const auto value = support(before_from_after);
    if (!value) failed = tl::unexpected(value.error());
    return value.value_or(0.0);
  };
  auto registered = comparison::register_surfaces(runs.after_surface.mesh, runs.before_surface.mesh,
                                                  score, request.options, progress);
  ORBITFUSE_TRY(failed);
  const std::string which = runs.before.out.string() + " and " + runs.after.out.string();
  if (!registered) {
    Error error = registered.error();
    if (error.kind != ErrorKind::cancelled) error.where = which;
    return tl::unexpected(error);
  }
  runs.registration = *std::move(registered);
  ORBITFUSE_ASSIGN(runs.support, support(runs.registration.before_from_after));
  if (runs.support < request.options.least_support)
    return fail(ErrorKind::quality, which,
                fmt::format("photos of the one that renders of the other explain to {:.2f}, {:.2f} "
                            "are needed: not one object",
                            runs.support, request.options.least_support),
                "compare two runs of one object");
  return {};
}

/// AFTER's, BEFORE's brought to AFTER's unit, or both as one.
Status load_scale(ComparedRuns& runs) {
  ORBITFUSE_ASSIGN(runs.scale, stages::scale_of_run(runs.after.out));
  ORBITFUSE_ASSIGN(auto before, stages::scale_of_run(runs.before.out));
  if (!before) return {};
  before->metres_per_unit *= runs.registration.before_from_after.scale;
  // In AFTER's world BEFORE's scale is no surer than the ratio of both units.
  before->relative_uncertainty =
      std::hypot(before->relative_uncertainty, runs.registration.scale_sigma);
  if (!(before->relative_uncertainty < 1)) {
    if (!runs.scale)
      runs.scale_doubt =
          "BEFORE has one, but the surfaces don't hold how large its unit is in AFTER's world";
    return {};
  }
  if (!runs.scale) {
    runs.scale = before;
    return {};
  }
  const stages::MetricScale after = *runs.scale;
  runs.scale = stages::agreed_scale(after, *before);
  if (!runs.scale)
    runs.scale_doubt = fmt::format(
        "the runs' scales contradict each other: a unit after is {:.4f} m by its own ({}), "
        "{:.4f} m by the one before ({}); lengths are in units: tell one again (orbitfuse export "
        "RUN "
        "--distance A B LENGTH), or delete the wrong run's scale.json",
        after.metres_per_unit, after.source, before->metres_per_unit, before->source);
  return {};
}

SurfaceShares shares_of(const ComparedRuns& runs) {
  const std::vector<double> areas = comparison::vertex_areas(runs.after_surface.mesh);
  SurfaceShares shares;
  double all = 0;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    all += areas[i];
    (runs.change[i] == SurfaceChange::changed    ? shares.changed
     : runs.change[i] == SurfaceChange::not_seen ? shares.not_seen
     : runs.points[i].known()                    ? shares.compared
                                                 : shares.without_temperature) += areas[i];
  }
  if (all > 0)
    for (double* share :
         {&shares.compared, &shares.changed, &shares.not_seen, &shares.without_temperature})
      *share /= all;
  return shares;
}

Status compare_surfaces(const CompareRequest& request, const Progress& progress,
                        ComparedRuns& runs) {
  const Similarity3d& before_from_after = runs.registration.before_from_after;
  const comparison::KnownSurface after{&runs.after_surface.mesh, runs.after_surface.depth_noise,
                                       small_views(runs.after)},
      before{&runs.before_surface.mesh, runs.before_surface.depth_noise, small_views(runs.before)};
  ORBITFUSE_ASSIGN(runs.change, comparison::surface_change(after, before, before_from_after,
                                                           request.options, progress));
  ORBITFUSE_ASSIGN(const auto gone,
                   comparison::surface_change(before, after, before_from_after.inverse(),
                                              request.options, progress));
  const auto came = comparison::changed_regions(*after.mesh, runs.change, request.options);
  comparison::add_feet(*after.mesh, came, request.options, runs.change);
  runs.came = comparison::changed_regions(*after.mesh, runs.change, request.options);
  runs.gone = comparison::changed_regions(*before.mesh, gone, request.options);
  for (comparison::DifferenceRegion& region : runs.gone) {
    region.middle = before_from_after.inverse() * region.middle;
    region.place = before_from_after.inverse() * region.place;
    region.area /= before_from_after.scale * before_from_after.scale;
  }
  return {};
}

Status compare_temperatures(const CompareRequest& request, const Progress& progress,
                            ComparedRuns& runs) {
  ORBITFUSE_ASSIGN(const auto after,
                   stages::load_measurement_scene(runs.after.out, *runs.after.session));
  ORBITFUSE_ASSIGN(const auto before,
                   stages::load_measurement_scene(runs.before.out, *runs.before.session));
  const TriangleMesh& mesh = runs.after_surface.mesh;
  ORBITFUSE_ASSIGN(runs.points,
                   comparison::temperature_difference(
                       {&mesh, &runs.before_surface.mesh, runs.registration.before_from_after,
                        runs.registration.residual, runs.change},
                       after, before, progress));
  const auto common = comparison::common_difference(mesh, runs.points);
  if (!common)
    return fail(ErrorKind::quality, runs.after.out.string(),
                "no place that thermal frames of both runs see",
                "record both thermal orbits round the same side");
  runs.common_k = *common;
  runs.taken_k = request.ambient ? *common : 0;
  runs.differences =
      comparison::difference_regions(mesh, runs.points, runs.taken_k, request.options);
  return {};
}

}  // namespace

Status check_comparable(const fs::path& before, const fs::path& after,
                        const stages::RunConfig& config, const CompareRequest& request,
                        const Progress& progress) {
  ORBITFUSE_TRY(request.options.validate());
  for (const fs::path& out : {before, after}) {
    ORBITFUSE_TRY(complete_run(out, config, progress));
    ORBITFUSE_TRY(stages::scale_of_run(out));
  }
  return {};
}

Result<ComparedRuns> compare_runs(const fs::path& before, const fs::path& after,
                                  const stages::RunConfig& config, const CompareRequest& request,
                                  const Progress& progress) {
  ORBITFUSE_TRY(request.options.validate());
  ComparedRuns runs;
  ORBITFUSE_ASSIGN(runs.before, complete_run(before, config, progress));
  ORBITFUSE_ASSIGN(runs.after, complete_run(after, config, progress));
  ORBITFUSE_ASSIGN(runs.before_surface, surface_of(runs.before, request, progress));
  ORBITFUSE_ASSIGN(runs.after_surface, surface_of(runs.after, request, progress));
  runs.least_difference_k = request.options.least_difference_k;
  ORBITFUSE_TRY(register_runs(request, progress, runs));
  ORBITFUSE_TRY(load_scale(runs));
  ORBITFUSE_TRY(compare_surfaces(request, progress, runs));
  ORBITFUSE_TRY(compare_temperatures(request, progress, runs));
  runs.shares = shares_of(runs);
  return runs;
}

}  // namespace orbitfuse::comparing
