// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/tracks.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "core/geometry/nearest_to_lines.hpp"
#include "core/numeric/angle_units.hpp"
#include "core/system/parallel.hpp"
#include "recon/poses/index.hpp"
#include "recon/poses/sfm/joined_sets.hpp"

namespace orbitfuse {
namespace {

using Features = std::vector<std::pair<int, int>>;

/// Sets of two and more posed frames, without the frames that one shows twice.
std::vector<Features> connected(const FeatureGraph& graph, const PairMatches& matches,
                                const FramePoses& poses) {
  std::vector<int> first(at(graph.count()) + 1, 0);
  for (int f = 0; f < graph.count(); ++f)
    first[at(f + 1)] = first[at(f)] + static_cast<int>(graph.pixels[at(f)].cols());
  JoinedSets sets(first.back());
  for (const auto& [pair, list] : matches)
    if (poses[at(pair.first)] && poses[at(pair.second)])
      for (const auto& [a, b] : list)
        sets.join(first[at(pair.first)] + a, first[at(pair.second)] + b);
  std::map<int, Features> by_root;
  for (int f = 0; f < graph.count(); ++f) {
    if (!poses[at(f)]) continue;
    for (int i = first[at(f)]; i < first[at(f + 1)]; ++i)
      by_root[sets.root(i)].emplace_back(f, i - first[at(f)]);
  }
  std::vector<Features> result;
  for (auto& [root, features] : by_root) {
    if (features.size() < 2) continue;
    Features once;
    for (std::size_t i = 0; i < features.size(); ++i) {
      const bool twice = (i > 0 && features[i - 1].first == features[i].first) ||
                         (i + 1 < features.size() && features[i + 1].first == features[i].first);
      if (!twice) once.push_back(features[i]);
    }
    if (once.size() >= 2) result.push_back(std::move(once));
  }
  return result;
}

Eigen::Vector3d nearest_point(const std::vector<Eigen::Vector3d>& centers,
                              const std::vector<Eigen::Vector3d>& directions) {
  NearestToLines rays;
  for (std::size_t i = 0; i < centers.size(); ++i) rays.add(centers[i], directions[i]);
  return rays.point();
}

struct Seen {
  std::vector<Eigen::Vector3d> center, direction;  ///< in the world
};

Seen seen_along(const FeatureGraph& graph, const PosedFrames& posed, const Features& features) {
  Seen seen;
  for (const auto& [f, i] : features) {
    const Rigid3d world = posed.poses[at(f)]->inverse();
    const Eigen::Vector3d ray = posed.cameras[at(f)].ray_of(graph.pixels[at(f)].col(i));
    seen.center.push_back(world.translation);
    seen.direction.push_back((world.rotation * ray).normalized());
  }
  return seen;
}

double error_px(const PosedFrames& posed, int frame, const Eigen::Vector3d& point,
                const Eigen::Vector2d& pixel) {
  const double e =
      (posed.cameras[at(frame)].project(*posed.poses[at(frame)] * point) - pixel).norm();
  return std::isfinite(e) ? e : 1e9;
}

Features agreeing(const FeatureGraph& graph, const PosedFrames& posed, const Features& features,
                  const Eigen::Vector3d& point, double max_error_px) {
  Features kept;
  for (const auto& [f, i] : features)
    if (error_px(posed, f, point, graph.pixels[at(f)].col(i)) <= max_error_px)
      kept.emplace_back(f, i);
  return kept;
}

std::optional<FeatureTrack> triangulated(const FeatureGraph& graph, const PosedFrames& posed,
                                         const Features& features, const TrackOptions& options) {
  std::vector<Eigen::Vector3d> rays;
  for (const auto& [f, i] : features)
    rays.push_back(posed.cameras[at(f)].ray_of(graph.pixels[at(f)].col(i)));
  FeatureTrack best;
  // Pairs of all in short tracks; of the first few in long ones, which hold many right pairs.
  const std::size_t tried = std::min<std::size_t>(features.size(), 8);
  for (std::size_t a = 0; a < tried; ++a)
    for (std::size_t b = a + 1; b < tried; ++b) {
      const auto point = meet(*posed.poses[at(features[a].first)], rays[a],
                              *posed.poses[at(features[b].first)], rays[b], options.min_angle_deg);
      if (!point) continue;
      Features kept = agreeing(graph, posed, features, *point, options.max_error_px);
      if (kept.size() > best.features.size()) best = {*point, std::move(kept)};
    }
  if (best.features.size() < 2) return std::nullopt;
  const Seen seen = seen_along(graph, posed, best.features);
  const Eigen::Vector3d refined = nearest_point(seen.center, seen.direction);
  Features kept = agreeing(graph, posed, features, refined, options.max_error_px);
  if (kept.size() >= best.features.size()) best = {refined, std::move(kept)};
  return best;
}

}  // namespace

std::optional<Eigen::Vector3d> meet(const Rigid3d& first, const Eigen::Vector3d& first_ray,
                                    const Rigid3d& second, const Eigen::Vector3d& second_ray,
                                    double min_angle_deg) {
  const Rigid3d w1 = first.inverse(), w2 = second.inverse();
  const Eigen::Vector3d d1 = (w1.rotation * first_ray).normalized(),
                        d2 = (w2.rotation * second_ray).normalized();
  if (std::atan2(d1.cross(d2).norm(), d1.dot(d2)) * degrees_per_radian < min_angle_deg)
    return std::nullopt;
  const Eigen::Vector3d point = nearest_point({w1.translation, w2.translation}, {d1, d2});
  if (!point.allFinite() || (first * point).z() <= 0 || (second * point).z() <= 0)
    return std::nullopt;
  return point;
}

std::vector<FeatureTrack> triangulate_tracks(const FeatureGraph& graph, const PairMatches& matches,
                                             const PosedFrames& posed,
                                             const TrackOptions& options) {
  const std::vector<Features> sets = connected(graph, matches, posed.poses);
  std::vector<std::optional<FeatureTrack>> found(sets.size());
  parallel_blocks(static_cast<int>(sets.size()), 256, [&](int begin, int end) {
    for (int i = begin; i < end; ++i)
      found[at(i)] = triangulated(graph, posed, sets[at(i)], options);
  });
  std::vector<FeatureTrack> tracks;
  for (auto& track : found)
    if (track) tracks.push_back(std::move(*track));
  return tracks;
}

std::vector<FeatureTrack> without_frame(const FeatureGraph& graph, const PosedFrames& posed,
                                        std::vector<FeatureTrack> tracks, int frame) {
  std::erase_if(tracks, [&](FeatureTrack& track) {
    if (std::erase_if(track.features, [&](const auto& seen) { return seen.first == frame; }) == 0)
      return false;
    if (track.features.size() < 2) return true;
    const Seen seen = seen_along(graph, posed, track.features);
    track.position = nearest_point(seen.center, seen.direction);
    return !track.position.allFinite();
  });
  return tracks;
}

int explained_matches(const FeatureGraph& graph, const PosedFrames& posed) {
  TrackOptions options;
  options.max_error_px *= graph.pixel_scale;
  const PairMatches matches = confirmed_matches(graph, posed, options.max_error_px);
  int explained = 0;
  for (const FeatureTrack& track : triangulate_tracks(graph, matches, posed, options))
    explained += static_cast<int>(track.features.size()) - 1;
  return explained;
}

Reconstruction reconstruction_of(const FeatureGraph& graph, const PosedFrames& posed,
                                 const std::vector<FeatureTrack>& tracks, Modality modality) {
  Reconstruction model;
  model.modality = modality;
  std::vector<int> view_of(at(graph.count()), -1);
  for (int f = 0; f < graph.count(); ++f) {
    if (!posed.poses[at(f)]) continue;
    view_of[at(f)] = static_cast<int>(model.views.size());
    model.views.push_back({graph.frames[at(f)]->file, posed.cameras[at(f)], *posed.poses[at(f)]});
  }
  for (const FeatureTrack& track : tracks) {
    SparsePoint point;
    point.position = track.position;
    for (const auto& [f, i] : track.features)
      point.track.push_back({view_of[at(f)], graph.pixels[at(f)].col(i)});
    model.points.push_back(std::move(point));
  }
  return model;
}

PosedFrames posed_frames(const FeatureGraph& graph, const Reconstruction& model) {
  PosedFrames posed{FramePoses(at(graph.count())), graph.cameras};
  std::map<std::string, const PosedView*> by_name;
  for (const PosedView& view : model.views) by_name[view.name] = &view;
  std::map<std::tuple<std::string, int, int>, Camera> lens;
  for (int f = 0; f < graph.count(); ++f) {
    const auto found = by_name.find(graph.frames[at(f)]->file);
    if (found == by_name.end()) continue;
    posed.poses[at(f)] = found->second->cam_from_world;
    const Camera& camera = posed.cameras[at(f)] = found->second->camera;
    lens[{graph.frames[at(f)]->device, camera.width, camera.height}] = camera;
  }
  for (int f = 0; f < graph.count(); ++f) {
    if (posed.poses[at(f)]) continue;
    Camera& camera = posed.cameras[at(f)];
    const auto known = lens.find({graph.frames[at(f)]->device, camera.width, camera.height});
    if (known != lens.end()) camera = known->second;
  }
  return posed;
}

EpipolarBand epipolar_band(const FeatureGraph& graph, const ViewPair& pair,
                           const PosedFrames& posed, double half_width_px) {
  const auto [a, b] = pair;
  const Rigid3d b_from_a = *posed.poses[at(b)] * posed.poses[at(a)]->inverse();
  const Eigen::Vector3d t = b_from_a.translation.normalized();
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  EpipolarBand band;
  band.essential = cross * b_from_a.rotation.toRotationMatrix();
  band.first_rays = graph.rays(a, posed.cameras[at(a)]);
  band.second_rays = graph.rays(b, posed.cameras[at(b)]);
  band.half_width = half_width_px / posed.cameras[at(b)].fx;
  return band;
}

PairMatches confirmed_matches(const FeatureGraph& graph, const PosedFrames& posed,
                              double max_error_px) {
  PairMatches result;
  for (const auto& [pair, matches] : graph.proposed) {
    if (!posed.poses[at(pair.first)] || !posed.poses[at(pair.second)]) continue;
    const EpipolarBand band = epipolar_band(graph, pair, posed, max_error_px);
    for (const auto& [i, j] : matches)
      if (band.distance(i, j) <= band.half_width) result[pair].emplace_back(i, j);
  }
  return result;
}

std::vector<FeatureMatch> guided_matches(const FeatureGraph& graph, const ViewPair& pair,
                                         const PosedFrames& posed, double band_px) {
  return match_in_band(graph.descriptors[at(pair.first)], graph.descriptors[at(pair.second)],
                       epipolar_band(graph, pair, posed, band_px));
}

}  // namespace orbitfuse
