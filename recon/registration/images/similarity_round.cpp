// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/images/similarity_round.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/geometry/narrowed.hpp"
#include "core/system/parallel.hpp"
#include "recon/alignment/edge_field.hpp"

namespace orbitfuse {
namespace {

/// thermal_from_visible: angle-axis, translation, log scale.
using Parameters = std::array<double, 7>;

struct PatchOffset {
  ScenePatch patch;

  template <class T>
  bool operator()(const T* p, T* residual) const {
    const T point[3] = {T(patch.point.x()), T(patch.point.y()), T(patch.point.z())};
    T turned[3];
    ceres::AngleAxisRotatePoint(p, point, turned);
    const T scale = exp(p[6]);
    Eigen::Matrix<T, 3, 1> in_thermal;
    for (int i = 0; i < 3; ++i) in_thermal[i] = scale * turned[i] + p[3 + i];
    const Eigen::Matrix<T, 3, 1> x = patch.cam_from_thermal.rotation.cast<T>() * in_thermal +
                                     patch.cam_from_thermal.translation.cast<T>();
    if (!(x.z() > T(1e-6))) return false;
    const Camera& c = patch.camera;
    const T dx = T(c.fx) * x.x() / x.z() + T(c.cx) - T(patch.match.seen.x());
    const T dy = T(c.fy) * x.y() / x.z() + T(c.cy) - T(patch.match.seen.y());
    const Eigen::Matrix2d& w = patch.match.sqrt_weight;
    residual[0] = T(w(0, 0)) * dx + T(w(0, 1)) * dy;
    residual[1] = T(w(1, 0)) * dx + T(w(1, 1)) * dy;
    return true;
  }
};

Parameters parameters_of(const Similarity3d& thermal_from_visible) {
  Parameters p{};
  const double q[4] = {thermal_from_visible.rotation.w(), thermal_from_visible.rotation.x(),
                       thermal_from_visible.rotation.y(), thermal_from_visible.rotation.z()};
  ceres::QuaternionToAngleAxis(q, p.data());
  for (int i = 0; i < 3; ++i)
    p[static_cast<std::size_t>(3 + i)] = thermal_from_visible.translation[i];
  p[6] = std::log(thermal_from_visible.scale);
  return p;
}

Similarity3d similarity_of(const Parameters& p) {
  double q[4];
  ceres::AngleAxisToQuaternion(p.data(), q);
  return {
      std::exp(p[6]), Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized(), {p[3], p[4], p[5]}};
}

}  // namespace

Similarity3d agreed_similarity(const std::vector<ScenePatch>& patches,
                               const Similarity3d& thermal_from_visible) {
  Parameters p = parameters_of(thermal_from_visible);
  for (const double scale_px : {8.0, 4.0, 2.0, 1.0}) {
    ceres::Problem problem;
    for (const ScenePatch& patch : patches)
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<PatchOffset, 2, 7>(new PatchOffset{patch}),
          new ceres::ScaledLoss(new ceres::CauchyLoss(scale_px), patch.match.score,
                                ceres::TAKE_OWNERSHIP),
          p.data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = 30;
    options.num_threads = 1;  // one order of sums: the same result every time
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable()) return thermal_from_visible;
  }
  return similarity_of(p);
}

int SimilarityRound::matches(const Similarity3d& thermal_from_visible) const {
  const Parameters p = parameters_of(thermal_from_visible);
  int near = 0;
  for (const ScenePatch& patch : patches) {
    double r[2];
    near += PatchOffset{patch}(p.data(), r) && std::hypot(r[0], r[1]) < 2;
  }
  return near;
}

Result<SimilarityRound> match_scene(const SceneRenderer& visible,
                                    const std::vector<cv::Mat>& images,
                                    const std::vector<PosedView>& thermal,
                                    const Similarity3d& visible_from_thermal,
                                    const RenderRound& round, const Progress& progress) {
  SimilarityRound seen;
  std::vector<std::vector<ScenePatch>> of_view(thermal.size());
  std::vector<double> agreement(thermal.size());
  std::vector<SceneRender> renders;
  std::vector<Camera> cameras;
  std::vector<Rigid3d> poses;
  for (const PosedView& view : thermal) {
    ORBITFUSE_TRY(progress.check("register"));
    cameras.push_back(narrowed_to(view.camera, round.width_px).without_distortion());
    poses.push_back(rebase(view.cam_from_world, visible_from_thermal));
    ORBITFUSE_ASSIGN(SceneRender render, visible(cameras.back(), poses.back()));
    renders.push_back(std::move(render));
  }
  const PatchMatchOptions matching{round.search_px, round.patch_search_px, round.patch_radius_px,
                                   8};
  parallel_for(static_cast<int>(thermal.size()), [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    const cv::Mat edges = rendered_edges(renders[i]), field = edges_at(images[i], cameras[i]);
    const Rigid3d world_from_cam = poses[i].inverse();
    for (const PatchMatch& match : match_patches(renders[i], edges, cameras[i], field, matching))
      of_view[i].push_back(
          {match, world_from_cam * match.point, thermal[i].cam_from_world, cameras[i]});
    agreement[i] = edge_agreement(edges, field);
  });
  for (std::size_t i = 0; i < thermal.size(); ++i) {
    seen.patches.insert(seen.patches.end(), of_view[i].begin(), of_view[i].end());
    seen.agreement += agreement[i] / static_cast<double>(thermal.size());
  }
  return seen;
}

}  // namespace orbitfuse
