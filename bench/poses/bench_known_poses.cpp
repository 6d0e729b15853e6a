// SPDX-License-Identifier: BSD-3-Clause
// bench_known_poses SESSION GROUND_TRUTH [RUN]
// What is said of poses that come with the photos, right and spoilt (spoilt_poses.hpp): one row a
// kind, whether it is what should be said, and what is. With RUN, the folder of an earlier run of
// the session, the same of thermal poses in the world of its visible ones.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "bench/poses/spoilt_poses.hpp"
#include "core/formats/colmap_model.hpp"
#include "core/system/cpu.hpp"
#include "recon/assembly/field_renderer.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/poses/known/scene_check.hpp"
#include "recon/poses/known/session_poses.hpp"
#include "tests/support/orbit_scenes.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace orbitfuse;
namespace fs = std::filesystem;

struct Outcome {
  bool right = false;
  std::string words;
};

/// The session with known poses of one modality, in the order of its frames.
Session with_known(const scenes::Scene& scene, Modality modality,
                   const scenes::SpoiltPoses& spoilt) {
  Session session = scene.session;
  std::vector<FrameRecord*> frames;
  std::vector<PosedView> views;
  for (FrameRecord& frame : session.frames) {
    const auto truth = scene.truth.views.find(frame.file);
    if (frame.modality != modality || truth == scene.truth.views.end()) continue;
    frames.push_back(&frame);
    views.push_back(truth->second);
  }
  spoilt.spoil(views);
  for (std::size_t i = 0; i < frames.size(); ++i)
    frames[i]->camera = views[i].camera, frames[i]->cam_from_world = views[i].cam_from_world;
  return session;
}

std::string short_words(const std::string& words) {
  const auto looks = words.find("it looks as if ");
  return looks == std::string::npos ? "refused" : "refused: " + words.substr(looks + 15);
}

/// What was said, and whether it is what should be.
Outcome outcome_of(const Result<ModalityPoses>& poses, const scenes::SpoiltPoses& spoilt,
                   const std::vector<std::string>& files) {
  using scenes::Fault;
  if (!poses) return {spoilt.fault == Fault::all, short_words(poses.error().found)};
  std::vector<int> named;
  const auto name = [&](const std::string& file) {
    named.push_back(static_cast<int>(std::find(files.begin(), files.end(), file) - files.begin()));
  };
  for (const DroppedView& view : poses->dropped) name(view.name);
  for (const DoubtfulView& view : poses->doubtful) name(view.name);
  std::sort(named.begin(), named.end());
  const bool warned = !poses->warnings.empty();
  const auto gate = [&](const char* of) {
    const auto found = poses->gates.find(of);
    return found == poses->gates.end() ? -1.0 : found->second;
  };
  std::vector<int> wrong = spoilt.views;
  std::sort(wrong.begin(), wrong.end());
  // What is a little off may be named: some views are more so.
  const bool imprecise = spoilt.fault == Fault::imprecise;
  const bool right =
      spoilt.fault != Fault::all && (named == wrong || imprecise) && warned == imprecise;
  const std::string figures =
      poses->reconstruction.modality == Modality::visible
          ? fmt::format("{:.0f} %, {:.1f} px", 100 * gate("known_poses_match_share"),
                        gate("known_poses_miss_px"))
          : fmt::format("{:.0f} best, {:.2f} deg aside", gate("known_poses_best_of_all"),
                        gate("known_poses_apart_deg"));
  return {right, fmt::format("{} dropped, {} doubted{}; {}", poses->dropped.size(),
                             poses->doubtful.size(), warned ? ", warned" : "", figures)};
}

/// The world of an earlier run, whose visible poses and field take the place of known ones.
struct SeenScene {
  nerf::Field field;
  VisibleScene scene;
  Similarity3d world_from_truth;
};

Result<SeenScene> seen_scene(const fs::path& run, const scenes::Truth& truth) {
  SeenScene seen;
  ORBITFUSE_ASSIGN(seen.scene.reconstruction,
                   read_colmap_model(run / "poses_visible/model", Modality::visible));
  ORBITFUSE_ASSIGN(seen.field, nerf::Field::load(run / "train_visible/field.bin"));
  ORBITFUSE_ASSIGN(const Similarity3d truth_from_world,
                   scenes::truth_from_model(seen.scene.reconstruction, truth));
  seen.world_from_truth = truth_from_world.inverse();
  return seen;
}

Outcome thermal_outcome(const SeenScene& seen, const scenes::Scene& scene,
                        const scenes::SpoiltPoses& spoilt, const std::vector<std::string>& files) {
  const Progress silent;
  VisibleScene visible = seen.scene;
  visible.renderer = edge_renderer(seen.field, silent);
  const Session session = with_known(scene, Modality::thermal, spoilt);
  Result<ModalityPoses> poses = known_poses(session, Modality::thermal);
  if (!poses) return outcome_of(poses, spoilt, files);
  const auto contradiction = check_by_scene(session, visible, {}, *poses);
  if (!contradiction) return {false, contradiction.error().message()};
  if (*contradiction)
    poses = fail(ErrorKind::quality, "known thermal poses", (*contradiction)->words, "");
  return outcome_of(poses, spoilt, files);
}

std::vector<std::string> files_of(const scenes::Scene& scene, Modality modality) {
  std::vector<std::string> files;
  for (const FrameRecord& frame : scene.session.frames)
    if (frame.modality == modality && scene.truth.views.contains(frame.file))
      files.push_back(frame.file);
  return files;
}

template <class Function>
void print_rows(const std::string& scene, const std::vector<scenes::SpoiltPoses>& kinds,
                const Function& outcome_of_kind) {
  for (const scenes::SpoiltPoses& spoilt : kinds) {
    const auto start = std::chrono::steady_clock::now();
    const Outcome outcome = outcome_of_kind(spoilt);
    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    fmt::print("| {} | {} | {} | {} | {:.1f} s |\n", scene, spoilt.name,
               outcome.right ? "yes" : "NO", outcome.words, wall);
    std::fflush(stdout);
  }
}

Status run(const fs::path& folder, const fs::path& truth, const fs::path& earlier) {
  ORBITFUSE_ASSIGN(scenes::Scene scene, scenes::run_scene(folder, truth));
  const Modality modality = earlier.empty() ? Modality::visible : Modality::thermal;
  const std::vector<std::string> files = files_of(scene, modality);
  constexpr std::size_t least_files = 6;  // to exchange and turn single ones among
  if (files.size() < least_files)
    return fail(ErrorKind::input, truth.string(),
                fmt::format("{} {} poses", files.size(), name(modality)), "give six or more");
  const auto kinds = scenes::spoilt_poses(static_cast<int>(files.size()), modality);
  if (earlier.empty()) {
    print_rows(folder.string(), kinds, [&](const scenes::SpoiltPoses& spoilt) {
      const test::TempFolder work;
      return outcome_of(
          estimate_visible_poses(with_known(scene, modality, spoilt), {}, work.path(), {}), spoilt,
          files);
    });
    return {};
  }
  ORBITFUSE_ASSIGN(const SeenScene seen, seen_scene(earlier, scene.truth));
  for (auto& [file, view] : scene.truth.views)
    view.cam_from_world = rebase(view.cam_from_world, seen.world_from_truth);
  print_rows(folder.string(), kinds, [&](const scenes::SpoiltPoses& spoilt) {
    return thermal_outcome(seen, scene, spoilt, files);
  });
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    fmt::print(stderr, "bench_known_poses SESSION GROUND_TRUTH [RUN]\n");
    return 2;
  }
  fmt::print("{}\n", cpu_description());
  const Status done = run(argv[1], argv[2], argc == 4 ? argv[3] : "");
  if (!done) fmt::print(stderr, "{}\n", done.error().message());
  return done ? 0 : 1;
}
