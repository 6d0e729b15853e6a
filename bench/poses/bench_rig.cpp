// SPDX-License-Identifier: BSD-3-Clause
// bench_rig SESSION RUN: where both cameras shared a rig, unknown to the pipeline, frames of the
// same source name were taken from (almost) the same place. Prints how far the camera centres of
// the two modalities lie apart after the run's similarity, and after the best one there is.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "core/colmap_model.hpp"
#include "core/session.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/poses/proxy_images.hpp"
#include "recon/poses/similarity_refinement.hpp"

namespace {

using namespace orbitfuse;
namespace fs = std::filesystem;
using nlohmann::json;

/// Camera centres by the stem of the file that each frame was imported from.
std::map<std::string, Eigen::Vector3d> centers(const Session& session,
                                               const Reconstruction& model) {
  std::map<std::string, std::string> source;
  for (const FrameRecord& frame : session.frames)
    source[frame.file] = fs::path(frame.source).stem().string();
  std::map<std::string, Eigen::Vector3d> result;
  for (const PosedView& view : model.views)
    result[source[view.name]] = camera_center(view.cam_from_world);
  return result;
}

void print(const char* what, const Eigen::Matrix4d& m, const Eigen::Matrix3Xd& from,
           const Eigen::Matrix3Xd& to, double extent) {
  std::vector<double> apart;
  for (Eigen::Index i = 0; i < from.cols(); ++i)
    apart.push_back(
        (m.topLeftCorner<3, 3>() * from.col(i) + m.topRightCorner<3, 1>() - to.col(i)).norm() /
        extent);
  std::sort(apart.begin(), apart.end());
  fmt::print(
      "{}: centres of {} pairs apart by {:.2f} % of the extent in the median, {:.2f} % at worst\n",
      what, apart.size(), 100 * apart[apart.size() / 2], 100 * apart.back());
}

Status run(const fs::path& folder, const fs::path& out) {
  ORBITFUSE_ASSIGN(const Session session, open_session(folder));
  ORBITFUSE_ASSIGN(const Reconstruction visible,
                   read_colmap_model(out / "poses_visible/model", Modality::visible));
  ORBITFUSE_ASSIGN(const Reconstruction thermal,
                   read_colmap_model(out / "poses_thermal/model", Modality::thermal));
  std::ifstream stream(out / "register/registration.json");
  const json found = json::parse(stream, nullptr, false);
  if (found.is_discarded())
    return fail(ErrorKind::input, "registration.json", "absent or not JSON",
                "run the register stage");
  const json& s = found.at("visible_from_thermal");
  const auto q = s.at("rotation_wxyz").get<std::vector<double>>(),
             t = s.at("translation").get<std::vector<double>>();
  const Similarity3d similarity{
      s.at("scale").get<double>(), Eigen::Quaterniond(q[0], q[1], q[2], q[3]), {t[0], t[1], t[2]}};

  const auto of_visible = centers(session, visible), of_thermal = centers(session, thermal);
  std::vector<Eigen::Vector3d> from, to;
  for (const auto& [name, center] : of_thermal)
    if (of_visible.contains(name)) from.push_back(center), to.push_back(of_visible.at(name));
  if (from.size() < 3)
    return fail(ErrorKind::input, folder.string(), "fewer than 3 pairs", "give a session of a rig");
  Eigen::Matrix3Xd a(3, static_cast<Eigen::Index>(from.size())), b = a;
  double extent = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    a.col(static_cast<Eigen::Index>(i)) = from[i], b.col(static_cast<Eigen::Index>(i)) = to[i];
    for (const Eigen::Vector3d& other : to) extent = std::max(extent, (other - to[i]).norm());
  }
  print("similarity of the run", similarity.matrix(), a, b, extent);
  const Eigen::Matrix4d best = Eigen::umeyama(a, b, true);
  print("best similarity of the centres", best, a, b, extent);
  ORBITFUSE_ASSIGN(const nerf::Field field, nerf::Field::load(out / "train_visible/field.bin"));
  const Progress progress;
  const SceneRenderer renderer = [&](const Camera& camera, const Rigid3d& pose) -> Result<SceneView> {
    nerf::RenderOptions coarse;
    coarse.sample_factor = 0.5;
    ORBITFUSE_ASSIGN(const nerf::RenderedView seen, nerf::render(field, camera, pose, coarse, progress));
    SceneView view{{}, seen.depth};
    cv::cvtColor(seen.color, view.brightness, cv::COLOR_RGB2GRAY);
    return view;
  };
  std::vector<cv::Mat> images;
  for (const PosedView& view : thermal.views)
    for (const FrameRecord& frame : session.frames)
      if (frame.file == view.name) {
        ORBITFUSE_ASSIGN(cv::Mat image, read_luminance(session, frame));
        images.push_back(std::move(image));
      }
  ORBITFUSE_ASSIGN(const SimilarityRefinement refined,
                   refine_similarity(renderer, images, thermal.views, similarity, similarity_rounds(), progress));
  fmt::print("refined by the thermal images' edges: agreement {:.4f} to {:.4f}, patches {} to {}: {}\n",
             refined.agreement_before, refined.agreement_after, refined.matches_before, refined.matches_after,
             refined.improved ? "kept" : "refused");
  print("refined similarity", refined.visible_from_thermal.matrix(), a, b, extent);
  const double scale = std::cbrt(best.topLeftCorner<3, 3>().determinant());
  const Eigen::Quaterniond rotation(Eigen::Matrix3d(best.topLeftCorner<3, 3>() / scale));
  // A higher agreement from there says that the search failed, a lower one that the score does.
  ORBITFUSE_ASSIGN(const SimilarityRefinement from_best,
                   refine_similarity(renderer, images, thermal.views,
                                     {scale, rotation, best.topRightCorner<3, 1>()},
                                     similarity_rounds(), progress));
  fmt::print("refined from the best similarity of the centres: agreement {:.4f} to {:.4f}, patches {} to {}\n",
             from_best.agreement_before, from_best.agreement_after, from_best.matches_before,
             from_best.matches_after);
  print("refined from there", from_best.visible_from_thermal.matrix(), a, b, extent);
  fmt::print("between the two: scale {:.2f} %, rotation {:.2f} deg\n",
             100 * (similarity.scale / scale - 1),
             rotation_angle_deg(rotation, similarity.rotation));
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("bench_rig SESSION RUN\n", stderr);
    return 2;
  }
  const Status done = run(argv[1], argv[2]);
  if (!done) std::fprintf(stderr, "%s\n", done.error().message().c_str());
  return done ? 0 : 1;
}
