// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/guided_matching.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "core/system/parallel.hpp"
#include "recon/poses/index.hpp"
#include "recon/poses/sfm/resection.hpp"

namespace orbitfuse {
namespace {

/// Takes the poses of frames that don't hold the most through points: two parts without would have
/// no common scale. Whether any lost its own.
bool keep_connected(const std::vector<FeatureTrack>& tracks, FramePoses& poses) {
  std::map<ViewPair, int> shared;
  for (const FeatureTrack& track : tracks)
    for (std::size_t a = 0; a < track.features.size(); ++a)
      for (std::size_t b = a + 1; b < track.features.size(); ++b)
        ++shared[std::minmax(track.features[a].first, track.features[b].first)];
  std::vector<ViewPair> edges;
  for (const auto& [pair, count] : shared)
    if (count >= min_shared_points) edges.push_back(pair);
  const std::vector<bool> inside = largest_part(static_cast<int>(poses.size()), edges);
  bool lost = false;
  for (std::size_t f = 0; f < poses.size(); ++f) {
    if (inside[f]) continue;
    lost = lost || poses[f].has_value();
    poses[f].reset();
  }
  return lost;
}

/// Whether more than the poses speaks for a track: a match of two views that was looked for along
/// their epipolar lines agrees with any pose they have, so it needs a third view or Lowe's test
/// against the whole image.
bool confirmed(const FeatureGraph& graph, const FeatureTrack& track) {
  if (track.features.size() > 2) return true;
  const auto& [a, i] = track.features.front();
  const auto& [b, j] = track.features.back();
  const auto proposed = graph.proposed.find({a, b});  // features go by frame
  if (proposed == graph.proposed.end()) return false;
  const std::vector<FeatureMatch>& matches = proposed->second;
  return std::find(matches.begin(), matches.end(), FeatureMatch{i, j}) != matches.end();
}

/// Each posed view with those that look most nearly the same way.
std::vector<ViewPair> neighbours(const PosedFrames& posed) {
  constexpr double max_angle_deg = 50;  // beyond, descriptors of one point have little in common
  constexpr std::size_t most = 8;       // an orbit of 30 degrees and two loops has five
  const double least_cosine = std::cos(max_angle_deg * EIGEN_PI / 180);
  const auto axis = [&](int f) {
    return Eigen::Vector3d(posed.poses[at(f)]->rotation.conjugate() * Eigen::Vector3d::UnitZ());
  };
  std::set<ViewPair> pairs;
  const auto count = static_cast<int>(posed.poses.size());
  for (int f = 0; f < count; ++f) {
    if (!posed.poses[at(f)]) continue;
    std::vector<std::pair<double, int>> near;
    for (int g = 0; g < count; ++g)
      if (g != f && posed.poses[at(g)] && axis(f).dot(axis(g)) > least_cosine)
        near.emplace_back(-axis(f).dot(axis(g)), g);
    std::sort(near.begin(), near.end());
    if (near.size() > most) near.resize(most);
    for (const auto& [cosine, g] : near) pairs.insert(std::minmax(f, g));
  }
  return {pairs.begin(), pairs.end()};
}

/// Tracks of the matches that more than the poses speaks for.
std::vector<FeatureTrack> confirmed_tracks(const FeatureGraph& graph, const PairMatches& matches,
                                           const PosedFrames& posed, double max_error_px) {
  TrackOptions options;
  options.max_error_px = max_error_px;
  std::vector<FeatureTrack> tracks = triangulate_tracks(graph, matches, posed, options);
  std::erase_if(tracks, [&](const FeatureTrack& track) { return !confirmed(graph, track); });
  return tracks;
}

/// In pixels of the proxies: what an adjusted model's lines are off by, and no wider.
constexpr double again_px = 3;

}  // namespace

std::vector<bool> largest_part(int count, const std::vector<ViewPair>& edges) {
  std::vector<int> part(at(count));
  std::iota(part.begin(), part.end(), 0);
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [a, b] : edges) {
      const int low = std::min(part[at(a)], part[at(b)]);
      changed = changed || part[at(a)] != low || part[at(b)] != low;
      part[at(a)] = part[at(b)] = low;
    }
  }
  std::vector<int> size(at(count), 0);
  for (const int p : part) ++size[at(p)];
  const int largest = static_cast<int>(std::max_element(size.begin(), size.end()) - size.begin());
  std::vector<bool> inside;
  for (const int p : part) inside.push_back(p == largest);
  return inside;
}

void match_along_lines(const FeatureGraph& graph, const PosedFrames& posed, double band_px,
                       PairMatches& matches) {
  const std::vector<ViewPair> pairs = neighbours(posed);
  std::vector<std::vector<FeatureMatch>> found(pairs.size());
  parallel_for(static_cast<int>(pairs.size()),
               [&](int p) { found[at(p)] = guided_matches(graph, pairs[at(p)], posed, band_px); });
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    // Many fewer than before: the lines are off, not the matches.
    std::vector<FeatureMatch>& of_pair = matches[pairs[p]];
    if (2 * found[p].size() >= of_pair.size()) of_pair = std::move(found[p]);
  }
}

void pose_by_others(const FeatureGraph& graph, const PairMatches& matches, PosedFrames& posed) {
  TrackOptions options;
  options.max_error_px *= graph.pixel_scale;
  const std::vector<FeatureTrack> tracks = triangulate_tracks(graph, matches, posed, options);
  FramePoses moved = posed.poses;
  parallel_for(graph.count(), [&](int f) {
    if (!moved[at(f)]) return;
    if (const auto pose = resect_by_others(graph, tracks, posed, f, {})) moved[at(f)] = pose;
  });
  posed.poses = std::move(moved);
}

Result<Reconstruction> adjusted(const FeatureGraph& graph, const PairMatches& matches,
                                double max_error_px, PosedFrames& posed, const Adjuster& adjust) {
  std::vector<FeatureTrack> tracks = confirmed_tracks(graph, matches, posed, max_error_px);
  if (keep_connected(tracks, posed.poses))
    tracks = confirmed_tracks(graph, matches, posed, max_error_px);
  Reconstruction model = reconstruction_of(graph, posed, tracks, graph.frames.front()->modality);
  if (model.views.size() < 2)
    return fail(ErrorKind::quality, "structure from motion", "no two views hold each other",
                "take views every 30 deg or closer");
  return adjust(std::move(model));
}

double observations_a_view(const Reconstruction& model) {
  std::size_t seen = 0;
  for (const SparsePoint& point : model.points) seen += point.track.size();
  return static_cast<double>(seen) /
         static_cast<double>(std::max<std::size_t>(model.views.size(), 1));
}

PairMatches matches_along_own_lines(const FeatureGraph& graph, const PosedFrames& posed) {
  PairMatches matches = confirmed_matches(graph, posed, again_px * graph.pixel_scale);
  match_along_lines(graph, posed, again_px * graph.pixel_scale, matches);
  return matches;
}

Reconstruction rematched(const FeatureGraph& graph, const Reconstruction& model) {
  const PosedFrames posed = posed_frames(graph, model);
  return reconstruction_of(graph, posed,
                           confirmed_tracks(graph, matches_along_own_lines(graph, posed), posed,
                                            again_px * graph.pixel_scale),
                           model.modality);
}

}  // namespace orbitfuse
