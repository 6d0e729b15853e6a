// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/mat_scale.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "capture/mat/mat_finder.hpp"
#include "core/geometry/nearest_to_lines.hpp"
#include "core/image/image_io.hpp"
#include "core/image/undistorted.hpp"
#include "recon/registration/similarity.hpp"

namespace orbitfuse::exporting {
namespace {
using stages::MetricScale;

/// Two views 6 degrees apart; from nearer together a tenth of a pixel moves the place by more than
/// the mat is to say.
constexpr double least_crossing = 0.0025;
/// Of the mat's side: how far a tag may lie from where it should (bent paper, a wrong pose).
constexpr double most_off = 0.03;
/// What visible poses are off by together, which no tag shows (docs/benchmarks/poses_visible.md).
constexpr double common_error = 0.001;

/// As the finder wants it: a pinhole with its principal point in the middle.
Camera centred(const Camera& camera) {
  Camera middle = camera.without_distortion();
  middle.fy = middle.fx;
  middle.cx = camera.width / 2.0;
  middle.cy = camera.height / 2.0;
  return middle;
}

/// Where the diagonals cross: blur that draws all four corners inwards leaves it where it is.
Eigen::Vector2d middle_of(const cv::Point2d* corners) {
  const auto at = [&](int i) { return Eigen::Vector3d(corners[i].x, corners[i].y, 1); };
  return at(0).cross(at(2)).cross(at(1).cross(at(3))).hnormalized();
}

void add_rays(const MatCorners& corners, const PosedView& view, std::vector<TagRay>& rays) {
  const Camera camera = centred(view.camera);
  const Rigid3d world_from_cam = view.cam_from_world.inverse();
  for (std::size_t i = 0; i + 4 <= corners.image.size(); i += 4) {
    // The finder's pixel centres are whole numbers.
    const Eigen::Vector2d pixel = middle_of(&corners.image[i]) + Eigen::Vector2d(0.5, 0.5);
    const cv::Point3d on_mat = 0.5 * (corners.mat[i] + corners.mat[i + 2]);
    if (pixel.allFinite())
      rays.push_back({{on_mat.x, on_mat.y},
                      world_from_cam.translation,
                      world_from_cam.rotation * camera.ray_of(pixel).normalized()});
  }
}

}  // namespace

Result<MetricScale> scale_of_tags(const std::vector<TagRay>& rays, const MatDesign& design) {
  std::map<std::pair<long, long>, NearestToLines> meeting;
  std::map<std::pair<long, long>, Eigen::Vector2d> on_mat;
  for (const TagRay& ray : rays) {
    const Eigen::Vector2d place = 2 * ray.on_mat_m / design.pitch_m();
    const std::pair key(std::lround(place.x()), std::lround(place.y()));
    meeting[key].add(ray.from, ray.direction);
    on_mat[key] = ray.on_mat_m;
  }
  registration::Points seen, printed;
  for (const auto& [key, lines] : meeting) {
    if (!(lines.crossing() > least_crossing)) continue;
    seen.push_back(lines.point());
    printed.emplace_back(on_mat[key].x(), on_mat[key].y(), 0);
  }
  const auto too_few = [&](const std::string& found) {
    return fail(ErrorKind::input, "mat", found,
                "see that the whole mat lies round the object, or tell one distance: --distance");
  };
  if (seen.size() < 3)
    return too_few(fmt::format("{} tags are seen from different sides", seen.size()));
  const auto fit = registration::robust_umeyama(seen, printed, most_off * design.size_m);
  if (!fit || fit->inlier_ratio < 0.5) return too_few("its tags don't lie as they were printed");
  double weight = 0, squares = 0, spread = 0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < seen.size(); ++i)
    weight += fit->weights[i], middle += fit->weights[i] * printed[i];
  middle /= weight;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    squares += fit->weights[i] * (fit->target_from_source * seen[i] - printed[i]).squaredNorm();
    spread += fit->weights[i] * (printed[i] - middle).squaredNorm();
  }
  const double freedom = std::max(1.0, 3 * weight - 7);
  MetricScale scale{fit->target_from_source.scale,
                    std::hypot(std::sqrt(squares / freedom / spread), common_error), "mat",
                    fmt::format("{:.0f} tags, {:.4f} m off", weight, std::sqrt(squares / weight))};
  ORBITFUSE_TRY(scale.validate("mat"));
  return scale;
}

Result<MetricScale> scale_of_mat(const view::FinishedRun& run, const MatDesign& design,
                                 const Progress& progress) {
  ORBITFUSE_TRY(design.validate());
  if (!run.session)
    return fail(ErrorKind::input, "mat", "the session is not where the run read it",
                "bring it back");
  std::vector<TagRay> rays;
  for (const view::RecordedView& v : run.views) {
    if (v.modality != Modality::visible || v.doubt) continue;
    ORBITFUSE_TRY(progress.check("mat"));
    // A new finder for each: what it would follow from one image to the next is not read.
    MatFinder finder(design);
    finder.set_focal_px(Modality::visible, v.view.camera.fx);
    ORBITFUSE_ASSIGN(const cv::Mat image, read_visible(run.session->folder / v.view.name));
    cv::Mat gray = image;
    if (image.channels() == 3) cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
    const Camera& camera = v.view.camera;
    ORBITFUSE_ASSIGN(const cv::Mat seen, recorded_as(gray, camera, centred(camera), v.view.name));
    const auto sighting = finder.find(seen, Modality::visible);
    if (sighting && !sighting->followed) add_rays(sighting->corners, v.view, rays);
  }
  return scale_of_tags(rays, design);
}

}  // namespace orbitfuse::exporting
