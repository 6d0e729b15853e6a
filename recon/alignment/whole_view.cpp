// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/whole_view.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "core/geometry/narrowed.hpp"
#include "core/numeric/angle_units.hpp"
#include "recon/alignment/edge_correlation.hpp"
#include "recon/alignment/edge_field.hpp"
#include "recon/alignment/patch_matching.hpp"

namespace orbitfuse {
namespace {

Rigid3d turn(double degrees, const Eigen::Vector3d& axis) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(degrees * radians_per_degree, axis)),
          Eigen::Vector3d::Zero()};
}

/// The camera turned so that what it showed at the principal point moves by the shift.
Rigid3d looking_aside(const Rigid3d& cam_from_world, const Camera& camera, const WholeMatch& by) {
  const Eigen::Vector3d to(by.shift_x_px / camera.fx, by.shift_y_px / camera.fy, 1);
  return Rigid3d{Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), to),
                 Eigen::Vector3d::Zero()} *
         cam_from_world;
}

}  // namespace

Rigid3d moved(const Rigid3d& cam_from_world, const Similarity3d& canonical_from_world,
              const OrbitMove& move) {
  // The world turns the other way under a camera that is carried round.
  Rigid3d cam = rebase(cam_from_world, canonical_from_world) *
                turn(-move.azimuth_deg, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d level = Eigen::Vector3d::UnitZ().cross(camera_center(cam));
  if (level.norm() > 0) cam = cam * turn(move.elevation_deg, level.normalized());
  cam.translation *= std::exp(move.log_radius);
  return rebase(cam, canonical_from_world.inverse());
}

WholeMatch match_whole(const cv::Mat& edges, const cv::Mat& field, int reach_px) {
  const double energy = cv::norm(edges) * cv::norm(field);
  WholeMatch best;
  if (!(energy > 0)) return best;
  // A few hundred shifts of some thousand pixels: summing them takes a tenth of a transform's time.
  const cv::Mat1f correlation =
      FieldPlanes(field, reach_px).correlation(edge_pixels(edges, 0), 0, 0, reach_px);
  for (int y = 0; y <= 2 * reach_px; ++y)
    for (int x = 0; x <= 2 * reach_px; ++x) {
      const double value = static_cast<double>(correlation(y, x)) / energy;
      if (value > best.correlation)
        best = {value, static_cast<double>(x - reach_px), static_cast<double>(y - reach_px)};
    }
  return best;
}

Result<double> ascend_correlation(const SceneRenderer& renderer,
                                  const Similarity3d& canonical_from_world, const cv::Mat& image,
                                  PosedView& view, const AscentOptions& options,
                                  const Progress& progress) {
  const Camera camera = narrowed_to(view.camera, options.width_px).without_distortion();
  const cv::Mat field = edges_at(image, camera);
  const auto match = [&](const Rigid3d& pose) -> Result<WholeMatch> {
    ORBITFUSE_TRY(progress.check("poses.thermal"));
    ORBITFUSE_ASSIGN(const SceneRender seen, renderer(camera, pose));
    return match_whole(rendered_edges(seen), field, options.reach_px);
  };
  Rigid3d pose = view.cam_from_world;
  ORBITFUSE_ASSIGN(WholeMatch best, match(pose));
  for (double step = options.first_step_deg; step >= options.last_step_deg; step /= 2) {
    const double in_radius = step / 100;
    const OrbitMove moves[] = {{step, 0, 0},  {-step, 0, 0},     {0, step, 0},
                               {0, -step, 0}, {0, 0, in_radius}, {0, 0, -in_radius}};
    for (int pass = 0; pass < 3; ++pass) {
      const double before = best.correlation;
      pose = looking_aside(pose, camera, best);
      best.shift_x_px = best.shift_y_px = 0;
      for (const OrbitMove& move : moves) {
        const Rigid3d there = moved(pose, canonical_from_world, move);
        ORBITFUSE_ASSIGN(const WholeMatch tried, match(there));
        if (tried.correlation <= best.correlation) continue;
        best = tried;
        pose = looking_aside(there, camera, best);
        best.shift_x_px = best.shift_y_px = 0;
      }
      if (best.correlation <= before) break;
    }
  }
  view.cam_from_world = looking_aside(pose, camera, best);
  return best.correlation;
}

}  // namespace orbitfuse
