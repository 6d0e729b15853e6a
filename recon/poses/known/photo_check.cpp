// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/known/photo_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "recon/poses/estimate/feature_level.hpp"
#include "recon/poses/index.hpp"
#include "recon/poses/known/line_misses.hpp"

namespace orbitfuse {
namespace {

/// Right poses of seven scenes hold 0.72 and more of every view's matches within the second, wrong
/// ones (turned by 5 degrees, a tenth of the distance aside, exchanged) 0.26 at most; within the
/// third those hold 0.52 at most (docs/benchmarks/input/known_poses.md).
constexpr double fine_px = 2, close_px = 4, coarse_px = 8;
/// Beyond, a match is a false one whatever the poses are.
constexpr double false_px = 16;
constexpr double wrong_share = 0.4, doubtful_share = 0.5;
/// Of a set that holds less the poses are not these photos' (0.32 at most where each is the next
/// image's, 0.5 and more where each is off by a degree and a hundredth of the distance).
constexpr double least_share = 0.4;
/// A mistake in common explains the photos if mended poses hold so much, and so much more, of the
/// matches: a focal length 1.3 times too long costs 0.57 of them and more.
constexpr double mended_share = 0.7, mended_gain = 0.25, suspect_share = 0.8;
/// True matches that miss by more in the median cost detail; right poses miss by 0.6 at most.
constexpr double precise_px = 1.5;
/// Fewer matches may all be false.
constexpr std::size_t least_of_view = 40, least_of_set = 100;

/// Features for this alone: with a third of the usual ones no share above changes by 0.05.
constexpr int check_features = 1000;
constexpr std::size_t pairs_a_view = 3, nearest_by_pose = 2;

std::string percent(double share) { return fmt::format("{:.0f} %", 100 * share); }

std::string words_of(const Held& held, double px) {
  return fmt::format(
      "of its {} matches with the other photos {} lie within {:.0f} px (of {:.0f}) of the lines "
      "that its known pose gives: correct it",
      held.all, percent(held.share()), px, missed_side_px);
}

/// Enough pairs, spread over all, to tell a mistake of all poses by.
PairMatches sampled(const PairMatches& matches) {
  constexpr std::size_t enough = 150;
  const std::size_t every = 1 + matches.size() / enough;
  PairMatches some;
  std::size_t index = 0;
  for (const auto& pair : matches)
    if (index++ % every == 0) some.insert(pair);
  return some;
}

/// Views are left out one by one, the one first that holds least: its neighbours' matches with it
/// speak against them no longer. Where all poses are a little off (`all_off`: times what is
/// precise), a view is named that is more so.
void name_wrong(const std::vector<PairMisses>& misses, int frames, double all_off,
                PhotoJudgement& judged) {
  std::vector<bool> without(at(frames), false);
  const auto fewer = [&](const Held& held, double share) {
    return held.all >= least_of_view && held.share() < share;
  };
  while (true) {
    const std::vector<Held> held = held_by_frame(misses, coarse_px * all_off, frames, without);
    int worst = -1;
    for (int f = 0; f < frames; ++f)
      if (!without[at(f)] && fewer(held[at(f)], wrong_share) &&
          (worst < 0 || held[at(f)].share() < held[at(worst)].share()))
        worst = f;
    if (worst < 0) break;
    without[at(worst)] = true;
    judged.wrong.emplace_back(at(worst), words_of(held[at(worst)], coarse_px * all_off));
  }
  const std::vector<Held> held = held_by_frame(misses, close_px * all_off, frames, without);
  for (int f = 0; f < frames; ++f)
    if (!without[at(f)] && fewer(held[at(f)], doubtful_share))
      judged.doubtful.emplace_back(at(f), words_of(held[at(f)], close_px * all_off));
}

}  // namespace

Result<PhotoJudgement> judge_by_photos(const FeatureGraph& graph, const Reconstruction& given,
                                       const Progress& progress) {
  const std::vector<PairMisses> misses =
      line_misses(graph, graph.verified, posed_frames(graph, given));
  PhotoJudgement judged;
  const Held close = held_within(misses, close_px);
  judged.matches = close.all;
  judged.share = close.share();
  judged.median_px = median_miss_px(misses, false_px);
  const int frames = graph.count();
  for (const Held& held : held_by_frame(misses, close_px, frames, std::vector<bool>(at(frames))))
    judged.checked += held.all >= least_of_view ? 1 : 0;
  if (judged.matches < least_of_set) {
    judged.checked = 0;
    return judged;
  }
  ORBITFUSE_TRY(progress.check("poses.visible"));
  const double fine = held_within(misses, fine_px).share();
  if (fine < suspect_share) {
    const PairMatches some = sampled(graph.verified);
    const PoseFit fine_share = [&](const std::vector<PosedView>& views) -> Result<double> {
      ORBITFUSE_TRY(progress.check("poses.visible"));
      Reconstruction model;
      model.views = views;
      return held_within(line_misses(graph, some, posed_frames(graph, model)), fine_px).share();
    };
    ORBITFUSE_ASSIGN(judged.slip, likeliest_slip(given.views, fine_share));
    if (judged.slip && judged.slip->fit < std::max(mended_share, fine + mended_gain))
      judged.slip.reset();
  }
  const bool not_theirs = held_within(misses, coarse_px).share() < least_share;
  const double all_off = std::max(1.0, judged.median_px / precise_px);
  name_wrong(misses, frames, not_theirs ? 1 : all_off, judged);
  const auto wrong = static_cast<int>(judged.wrong.size());
  // Of three views one wrong one spoils two pairs of three.
  const bool most_wrong = 2 * wrong > judged.checked || (not_theirs && 3 * wrong > judged.checked);
  if (!judged.slip) judged.blocks = separate_blocks(misses, frames, all_off);
  judged.contradicted =
      judged.slip || judged.blocks || (most_wrong && 2 * judged.checked >= frames);
  return judged;
}

namespace {

/// Each view with those that look most nearly the same way from most nearly the same place.
void add_nearest(const std::vector<PosedView>& views, std::set<ViewPair>& pairs) {
  std::vector<Eigen::Vector3d> centers;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()),
                  high = -low;
  for (const PosedView& view : views) {
    centers.push_back(camera_center(view.cam_from_world));
    low = low.cwiseMin(centers.back()), high = high.cwiseMax(centers.back());
  }
  const double size = std::max((high - low).norm(), 1e-300);
  const auto axis = [&](std::size_t v) -> Eigen::Vector3d {
    return views[v].cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  };
  for (std::size_t v = 0; v < views.size(); ++v) {
    std::vector<std::pair<double, std::size_t>> near;
    for (std::size_t w = 0; w < views.size(); ++w)
      if (w != v)
        near.emplace_back((centers[v] - centers[w]).norm() / size + (axis(v) - axis(w)).norm() / 2,
                          w);
    const std::size_t most = std::min(nearest_by_pose, near.size());
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(most), near.end());
    for (std::size_t n = 0; n < most; ++n)
      pairs.insert(std::minmax(static_cast<int>(v), static_cast<int>(near[n].second)));
  }
}

/// Neighbours by the order of capture, which doesn't come from the poses, and by the poses, since
/// files may be in any order.
std::vector<ViewPair> pairs_to_check(const std::vector<const FrameRecord*>& frames,
                                     const std::vector<PosedView>& views) {
  const std::size_t count = frames.size(), a_fifth = count * (count - 1) / 10;
  const std::vector<ViewPair> list =
      count <= 8 ? exhaustive_pairs(static_cast<int>(count))
                 : nearest_pairs(frames, std::min(a_fifth, pairs_a_view * count));
  std::set<ViewPair> pairs(list.begin(), list.end());
  add_nearest(views, pairs);
  return {pairs.begin(), pairs.end()};
}

Result<FeatureGraph> matched(const Session& session, const std::vector<PosedView>& views,
                             PoseOptions options, const std::filesystem::path& folder,
                             const Progress& progress) {
  const std::vector<const FrameRecord*> frames = frames_of(session, views);
  options.max_features = std::min(options.max_features, check_features);
  progress.report({"poses.visible", 0, 2, {}, "features, to check the known poses"});
  ORBITFUSE_ASSIGN(FeatureLevel level,
                   FeatureLevel::extract(session, frames, options, folder, progress));
  progress.report({"poses.visible", 1, 2, {}, "matches, to check the known poses"});
  ORBITFUSE_TRY(level.match(pairs_to_check(frames, views), progress));
  return level.graph();
}

/// What would explain a contradiction; empty where nothing does.
std::string explanation(const PhotoJudgement& judged, const Reconstruction& given) {
  if (judged.slip)
    return fmt::format("; it looks as if {}: {} would then lie within {:.0f} px",
                       judged.slip->words, percent(judged.slip->fit), fine_px);
  if (!judged.blocks) return {};
  std::string text =
      "; it looks as if these sets of views, each right by itself, were of different worlds:";
  for (const std::vector<int>& block : judged.blocks->frames)
    text += fmt::format(" {} from {} to {},", block.size(), given.views[at(block.front())].name,
                        given.views[at(block.back())].name);
  return text + fmt::format(" of {} matches between them {} lie there", judged.blocks->across.all,
                            percent(judged.blocks->across.share()));
}

}  // namespace

Status check_by_photos(const Session& session, const PoseOptions& options,
                       const std::filesystem::path& workdir, const Progress& progress,
                       ModalityPoses& poses) {
  const auto unchecked = [&](const std::string& why) {
    poses.skips.push_back({"check of the known poses", why,
                           "whether they are these photos' is only seen in the renders"});
  };
  const Result<FeatureGraph> graph =
      matched(session, poses.reconstruction.views, options, workdir, progress);
  ORBITFUSE_TRY(progress.check("poses.visible"));
  if (!graph) {
    const ErrorKind kind = graph.error().kind;
    if (kind != ErrorKind::unavailable && kind != ErrorKind::quality)
      return tl::unexpected(graph.error());
    unchecked(graph.error().found);
    return {};
  }
  ORBITFUSE_ASSIGN(const PhotoJudgement judged,
                   judge_by_photos(*graph, poses.reconstruction, progress));
  poses.gates["known_poses_checked"] = judged.checked;
  if (judged.checked == 0) {
    unchecked(fmt::format("{} matches between photos could be judged", judged.matches));
    return {};
  }
  if (2 * judged.checked < graph->count())
    unchecked(fmt::format("{} of {} views have enough matches", judged.checked, graph->count()));
  poses.gates["known_poses_match_share"] = judged.share;
  poses.gates["known_poses_miss_px"] = judged.median_px;
  const std::string figures = fmt::format(
      "of {} matches between the photos {} lie within {:.0f} px (of {:.0f}) of the "
      "lines that the known poses give",
      judged.matches, percent(judged.share), close_px, missed_side_px);
  if (judged.contradicted)
    return fail(
        ErrorKind::quality, "known visible poses",
        figures + explanation(judged, poses.reconstruction),
        "correct them; poses.use_known_poses = false (--set) estimates them from the photos, "
        "poses.check_known_poses = false takes them as they are");
  poses.ladder.back().why += "; " + figures;
  take_known_verdicts(judged.wrong, judged.doubtful, DoubtReason::neighbours_elsewhere, poses);
  if (judged.median_px > precise_px)
    poses.warnings.push_back(
        fmt::format("the known poses miss the photos' matches by {:.1f} px (of {:.0f}) in the "
                    "median: poses estimated from the photos (--set poses.use_known_poses=false) "
                    "would show more detail",
                    judged.median_px, missed_side_px));
  return {};
}

}  // namespace orbitfuse
