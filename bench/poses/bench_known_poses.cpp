// SPDX-License-Identifier: BSD-3-Clause
// bench_known_poses SESSION GROUND_TRUTH ...
// What is said of poses that come with the photos, right and spoilt (spoilt_poses.hpp): one row a
// kind, one column a scene (SESSION: a folder that `orbitfuse import` or `record` wrote).
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "bench/poses/spoilt_poses.hpp"
#include "core/system/cpu.hpp"
#include "recon/poses/estimate_poses.hpp"
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
  const bool right =
      spoilt.fault != Fault::all && named == wrong && warned == (spoilt.fault == Fault::imprecise);
  return {right, fmt::format("{} dropped, {} doubted{}; {:.0f} %, {:.1f} px", poses->dropped.size(),
                             poses->doubtful.size(), warned ? ", warned" : "",
                             100 * gate("known_poses_match_share"), gate("known_poses_miss_px"))};
}

}  // namespace

int main(int argc, char** argv) {
  fmt::print("{}\n", cpu_description());
  for (int a = 1; a + 1 < argc; a += 2) {
    const Result<scenes::Scene> scene = scenes::run_scene(argv[a], argv[a + 1]);
    if (!scene) {
      fmt::print(stderr, "{}\n", scene.error().message());
      return 1;
    }
    std::vector<std::string> files;
    for (const FrameRecord& frame : scene->session.frames)
      if (frame.modality == Modality::visible && scene->truth.views.contains(frame.file))
        files.push_back(frame.file);
    for (const scenes::SpoiltPoses& spoilt : scenes::spoilt_poses(static_cast<int>(files.size()))) {
      const Session session = with_known(*scene, Modality::visible, spoilt);
      const test::TempFolder work;
      const auto start = std::chrono::steady_clock::now();
      const auto poses = estimate_visible_poses(session, {}, work.path(), {});
      const double wall =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const Outcome outcome = outcome_of(poses, spoilt, files);
      fmt::print("| {} | {} | {} | {} | {:.1f} s |\n", argv[a], spoilt.name,
                 outcome.right ? "yes" : "NO", outcome.words, wall);
      std::fflush(stdout);
    }
  }
}
