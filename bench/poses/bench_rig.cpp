// SPDX-License-Identifier: BSD-3-Clause
// bench_rig SESSION RUN [--disturbed DEGREES] [--starts]
// Where both cameras shared a rig, unknown to the pipeline, frames of the same source name were
// taken from (almost) the same place. Prints how far the camera centres of the two modalities lie
// apart after the run's similarity, after the best one there is, and after refinement by the
// thermal images from one start and by the search. --disturbed is for a run whose modalities were
// posed in one frame: its similarity is put wrong by that much, three ways. --starts prints what
// the search finds from each start.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "core/formats/colmap_model.hpp"
#include "core/session/session.hpp"
#include "core/system/clock.hpp"
#include "recon/alignment/luminance.hpp"
#include "recon/assembly/field_renderer.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/registration/similarity_search.hpp"
#include "tests/support/orbit_scenes.hpp"

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

Result<json> read(const fs::path& file) {
  std::ifstream stream(file);
  json value = json::parse(stream, nullptr, false);
  if (value.is_discarded())
    return fail(ErrorKind::input, file.string(), "absent or not JSON", "run the register stage");
  return value;
}

Similarity3d similarity_of(const json& s) {
  const auto q = s.at("rotation_wxyz").get<std::vector<double>>(),
             t = s.at("translation").get<std::vector<double>>();
  return {
      s.at("scale").get<double>(), Eigen::Quaterniond(q[0], q[1], q[2], q[3]), {t[0], t[1], t[2]}};
}

/// Camera centres that should coincide, in each world.
struct Pairs {
  Eigen::Matrix3Xd thermal, visible;
  double extent = 0;

  Pairs(const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& to)
      : thermal(3, static_cast<Eigen::Index>(from.size())), visible(thermal) {
    for (std::size_t i = 0; i < from.size(); ++i) {
      thermal.col(static_cast<Eigen::Index>(i)) = from[i];
      visible.col(static_cast<Eigen::Index>(i)) = to[i];
      for (const Eigen::Vector3d& other : to) extent = std::max(extent, (other - to[i]).norm());
    }
  }
  void print(const char* what, const Similarity3d& s) const {
    ::print(what, s.matrix(), thermal, visible, extent);
  }
};

/// One start against several, from the same answer of the clouds.
struct SimilarityComparison {
  const SceneRenderer& renderer;
  const std::vector<cv::Mat>& images;
  const std::vector<PosedView>& views;
  const Pairs& pairs;
  Progress progress;

  Status compare(const Similarity3d& start, bool clouds_decide) const {
    pairs.print("start", start);
    double before = cpu_seconds();
    ORBITFUSE_ASSIGN(
        const SimilarityRefinement single,
        refine_similarity(renderer, images, views, start, similarity_rounds(), progress));
    report("one start", single, before);
    before = cpu_seconds();
    SimilaritySearchOptions options;
    options.clouds_decide = clouds_decide;
    ORBITFUSE_ASSIGN(const SimilarityRefinement searched,
                     search_similarity(renderer, images, views, start, options, progress));
    for (const Skip& skip : searched.skips)
      fmt::print("skipped {}: {}; {}\n", skip.what, skip.why, skip.effect);
    report(fmt::format("search of {} starts", searched.starts).c_str(), searched, before);
    return {};
  }
  void report(const char* what, const SimilarityRefinement& r, double before) const {
    pairs.print(what, r.visible_from_thermal);
    fmt::print("  agreement {:.4f} to {:.4f}, patches {} to {}: {}; {:.1f} CPU s\n",
               r.agreement_before, r.agreement_after, r.matches_before, r.matches_after,
               r.improved ? "kept" : "refused", cpu_seconds() - before);
  }
};

/// Cameras that share a rig: where the search ends from the clouds' answer.
Status compare_with_rig(const Session& session, const fs::path& out, const Reconstruction& visible,
                        const Reconstruction& thermal, const SceneRenderer& renderer,
                        const std::vector<cv::Mat>& images, const Progress& progress) {
  const auto of_visible = centers(session, visible), of_thermal = centers(session, thermal);
  std::vector<Eigen::Vector3d> from, to;
  for (const auto& [name, center] : of_thermal)
    if (of_visible.contains(name)) from.push_back(center), to.push_back(of_visible.at(name));
  if (from.size() < 3)
    return fail(ErrorKind::input, session.folder.string(), "fewer than 3 pairs",
                "give a session of a rig");
  const Pairs pairs(from, to);
  ORBITFUSE_ASSIGN(const json found, read(out / "register/registration.json"));
  ORBITFUSE_ASSIGN(const json stage, read(out / "register/stage.json"));
  pairs.print("similarity of the run", similarity_of(found.at("visible_from_thermal")));
  const Eigen::Matrix4d m = Eigen::umeyama(pairs.thermal, pairs.visible, true);
  const double scale = std::cbrt(m.topLeftCorner<3, 3>().determinant());
  const Similarity3d best{scale,
                          Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>() / scale)),
                          m.topRightCorner<3, 1>()};
  pairs.print("best similarity of the centres", best);
  const SimilarityComparison comparison{renderer, images, thermal.views, pairs, progress};
  const json& metrics = stage.at("metrics");
  fmt::print("from the clouds' answer:\n");
  ORBITFUSE_TRY(comparison.compare(similarity_of(metrics.at("target_from_source")),
                                   !metrics.at("ambiguous").get<bool>()));
  // A higher agreement from there says that the search failed, a lower one that the score does.
  fmt::print("from the best similarity of the centres:\n");
  return comparison.compare(best, true);
}

/// Modalities posed in one frame: how far home from similarities that were put wrong.
Status compare_disturbed(const Reconstruction& thermal, const SceneRenderer& renderer,
                         const std::vector<cv::Mat>& images, double degrees,
                         const Progress& progress) {
  std::vector<Eigen::Vector3d> all;
  for (const PosedView& view : thermal.views) all.push_back(camera_center(view.cam_from_world));
  const Pairs pairs(all, all);
  const SimilarityComparison comparison{renderer, images, thermal.views, pairs, progress};
  const Eigen::Vector3d axes[] = {{1, 2, -1}, {-2, 1, 2}, {0, 0, 1}};
  for (int i = 0; i < 3; ++i) {
    const double sign = i % 2 ? -1 : 1;
    const Eigen::Vector3d axis = axes[i].normalized();
    const Similarity3d off{
        1 + sign * degrees / 200,
        Eigen::Quaterniond(Eigen::AngleAxisd(degrees * EIGEN_PI / 180, axis)),
        degrees / 300 * pairs.extent * axis.cross(Eigen::Vector3d(1, 1, 0).normalized())};
    ORBITFUSE_TRY(comparison.compare(off, true));
  }
  return {};
}

Status run(const fs::path& folder, const fs::path& out, double degrees, bool views) {
  ORBITFUSE_ASSIGN(const Session session, open_session(folder));
  ORBITFUSE_ASSIGN(const Reconstruction visible,
                   read_colmap_model(out / "poses_visible/model", Modality::visible));
  ORBITFUSE_ASSIGN(const Reconstruction thermal,
                   read_colmap_model(out / "poses_thermal/model", Modality::thermal));
  ORBITFUSE_ASSIGN(const nerf::Field field, nerf::Field::load(out / "train_visible/field.bin"));
  Progress progress;
  const SceneRenderer renderer = edge_renderer(field, progress);
  std::vector<cv::Mat> images;
  for (const PosedView& view : thermal.views)
    for (const FrameRecord& frame : session.frames)
      if (frame.file == view.name) {
        ORBITFUSE_ASSIGN(cv::Mat image, read_luminance(session, frame));
        images.push_back(std::move(image));
      }
  if (views) progress.report = [](const ProgressEvent& e) { fmt::print("  {}\n", e.detail); };
  if (degrees > 0) return compare_disturbed(thermal, renderer, images, degrees, progress);
  return compare_with_rig(session, out, visible, thermal, renderer, images, progress);
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  std::vector<std::string> places;
  double degrees = 0;
  bool each = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--starts")
      each = true;
    else if (word == "--disturbed" && i + 1 < argc)
      degrees = std::strtod(argv[++i], nullptr);
    else
      places.emplace_back(word);
  }
  if (places.size() != 2) {
    std::fputs("bench_rig SESSION RUN [--disturbed DEGREES] [--starts]\n", stderr);
    return 2;
  }
  const Status done = run(places[0], places[1], degrees, each);
  if (!done) std::fprintf(stderr, "%s\n", done.error().message().c_str());
  return done ? 0 : 1;
}
