// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/surface_difference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/option_range.hpp"
#include "recon/surface/surface.hpp"

namespace orbitfuse {
namespace {

/// Below it a ray met too little of the field for its value to be a surface's.
constexpr float least_opacity = 0.5F;
constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

/// A thermal field as a camera of the world sees it: depth in the world's unit, infinite where the
/// ray meets nothing.
struct Seen {
  cv::Mat kelvin, depth;
};
Result<Seen> seen_by(const PosedView& view, const SurfaceFields& fields,
                     const Similarity3d& world_from_fields, const Progress& progress) {
  const Similarity3d world_from_thermal = world_from_fields * fields.world_from_thermal;
  ORBITFUSE_ASSIGN(nerf::RenderedView render,
                   nerf::render(*fields.thermal, view.camera,
                                rebase(view.cam_from_world, world_from_thermal.inverse()), {},
                                progress));
  Seen seen{render.color, render.depth * world_from_thermal.scale};
  for (int y = 0; y < seen.depth.rows; ++y)
    for (int x = 0; x < seen.depth.cols; ++x)
      if (auto& z = seen.depth.at<float>(y, x);
          render.opacity.at<float>(y, x) < least_opacity || !std::isfinite(z))
        z = std::numeric_limits<float>::infinity();
  return seen;
}

bool usable(const SurfaceFields& fields) {
  return fields.thermal != nullptr && !fields.thermal->empty() && !fields.thermal_views.empty();
}

}  // namespace

Status SurfaceDifferenceOptions::validate() const {
  const OptionCheck check("compare");
  ORBITFUSE_TRY(check("width_px", width_px, from_to(16, 8192)));
  ORBITFUSE_TRY(check("same_depth", same_depth, between(0, 1)));
  ORBITFUSE_TRY(check("changed_depth", changed_depth, between(same_depth, 1)));
  ORBITFUSE_TRY(check("changed_share", changed_share, between(0, 1)));
  ORBITFUSE_TRY(check("least_views", least_views, at_least(1)));
  return check("max_angle_deg", max_angle_deg, between(0, 90));
}

Result<DifferencePicture> difference_picture(const PosedView& posed, const SurfaceFields& scene,
                                             const SurfaceFields& other,
                                             const Similarity3d& world_from_other,
                                             const SurfaceDifferenceOptions& options,
                                             const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  if (!usable(scene) || !usable(other))
    return fail(ErrorKind::input, "compare", "a run without a thermal field",
                "train both runs' thermal fields first");
  const Camera& full = posed.camera;
  const int width = std::min(full.width, options.width_px);
  const int height = std::max(
      2,
      static_cast<int>(std::lround(static_cast<double>(full.height) * width / full.width)));
  DifferencePicture picture;
  picture.view = {posed.name, full.scaled_to(width, height).without_distortion(),
                  posed.cam_from_world};
  ORBITFUSE_ASSIGN(const Seen here, seen_by(picture.view, scene, {}, progress));
  ORBITFUSE_ASSIGN(const Seen there, seen_by(picture.view, other, world_from_other, progress));
  picture.difference_k = cv::Mat(here.depth.size(), CV_32F, cv::Scalar(unknown));
  picture.only_here = cv::Mat::zeros(here.depth.size(), CV_8U);
  picture.only_there = cv::Mat::zeros(here.depth.size(), CV_8U);
  for (int y = 0; y < here.depth.rows; ++y)
    for (int x = 0; x < here.depth.cols; ++x) {
      const auto a = static_cast<double>(here.depth.at<float>(y, x)),
                 b = static_cast<double>(there.depth.at<float>(y, x)), nearer = std::min(a, b);
      if (!std::isfinite(nearer)) continue;
      if (std::abs(a - b) <= options.same_depth * nearer)
        picture.difference_k.at<float>(y, x) =
            here.kelvin.at<float>(y, x) - there.kelvin.at<float>(y, x);
      else if (std::abs(a - b) > options.changed_depth * nearer)
        (a < b ? picture.only_here : picture.only_there).at<std::uint8_t>(y, x) = 255;
    }
  return picture;
}

Result<std::vector<DifferencePicture>> difference_pictures(const SurfaceFields& scene,
                                                           const SurfaceFields& other,
                                                           const Similarity3d& world_from_other,
                                                           const SurfaceDifferenceOptions& options,
                                                           const Progress& progress) {
  std::vector<PosedView> cameras = scene.thermal_views;
  for (const PosedView& view : other.thermal_views)
    cameras.push_back({view.name, view.camera, rebase(view.cam_from_world, world_from_other)});
  std::vector<DifferencePicture> pictures;
  for (const PosedView& camera : cameras) {
    ORBITFUSE_TRY(progress.check("compare"));
    progress.report({"compare", static_cast<double>(pictures.size()),
                     static_cast<double>(cameras.size()), -1, camera.name});
    ORBITFUSE_ASSIGN(pictures.emplace_back(),
                     difference_picture(camera, scene, other, world_from_other, options, progress));
  }
  return pictures;
}

std::vector<DifferencePicture> seen_from_other(const std::vector<DifferencePicture>& pictures,
                                               const Similarity3d& world_from_other) {
  std::vector<DifferencePicture> swapped;
  for (const DifferencePicture& p : pictures)
    swapped.push_back({{p.view.name, p.view.camera,
                        rebase(p.view.cam_from_world, world_from_other.inverse())},
                       -p.difference_k,
                       p.only_there,
                       p.only_here});
  return swapped;
}

Result<SurfaceDifference> surface_difference(const TriangleMesh& mesh,
                                             const std::vector<DifferencePicture>& pictures,
                                             const SurfaceDifferenceOptions& options,
                                             const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  std::vector<PaintView> differences, changes;
  for (const DifferencePicture& picture : pictures) {
    // Difference, its square (for the spread), and the first again: paint wants three channels.
    cv::Mat squares, three, votes(picture.only_here.size(), CV_32F, cv::Scalar(unknown));
    cv::multiply(picture.difference_k, picture.difference_k, squares);
    cv::merge(std::vector<cv::Mat>{picture.difference_k, squares, picture.difference_k}, three);
    votes.setTo(0, picture.difference_k == picture.difference_k);  // a number: one surface
    votes.setTo(1, picture.only_here);
    differences.push_back({picture.view, three});
    changes.push_back({picture.view, votes});
  }
  ORBITFUSE_ASSIGN(const Painted painted,
                   paint(mesh, differences, options.max_angle_deg, progress));
  ORBITFUSE_ASSIGN(const Painted voted, paint(mesh, changes, options.max_angle_deg, progress));
  SurfaceDifference result;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const cv::Vec3f& value = painted.values[v];
    const bool told = voted.views[v] >= options.least_views;
    const bool changed =
        told && voted.values[v][0] > static_cast<float>(options.changed_share);  // false for NaN
    const bool same = told && !changed && std::isfinite(value[0]);
    result.change.push_back(changed ? SurfaceChange::changed
                            : same  ? SurfaceChange::same
                                    : SurfaceChange::unseen);
    result.difference_k.push_back(same ? value[0] : unknown);
    result.spread_k.push_back(
        same ? std::sqrt(std::max(0.0F, value[1] - value[0] * value[0])) : unknown);
  }
  return result;
}

}  // namespace orbitfuse
