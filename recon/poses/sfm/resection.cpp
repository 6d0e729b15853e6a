// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/resection.hpp"

#include <algorithm>
#include <map>
#include <opencv2/calib3d.hpp>
#include <set>

#include "core/geometry/rotation_vector.hpp"
#include "core/system/parallel.hpp"
#include "recon/poses/index.hpp"

namespace orbitfuse {
namespace {

/// Scene points that a frame's features may show.
struct Correspondences {
  std::vector<int> feature, track;
};

/// Feature of a posed frame -> its track.
std::map<std::pair<int, int>, int> index_of(const std::vector<FeatureTrack>& tracks) {
  std::map<std::pair<int, int>, int> index;
  for (std::size_t t = 0; t < tracks.size(); ++t)
    for (const auto& feature : tracks[t].features) index[feature] = static_cast<int>(t);
  return index;
}

Correspondences correspondences(const FeatureGraph& graph, int frame,
                                const std::map<std::pair<int, int>, int>& track_of) {
  std::set<std::pair<int, int>> found;
  for (const auto& [pair, matches] : graph.proposed) {
    if (pair.first != frame && pair.second != frame) continue;
    const bool first = pair.first == frame;
    for (const auto& [a, b] : matches) {
      const auto track = track_of.find({first ? pair.second : pair.first, first ? b : a});
      if (track != track_of.end()) found.insert({first ? a : b, track->second});
    }
  }
  Correspondences result;
  for (const auto& [feature, track] : found) {
    result.feature.push_back(feature);
    result.track.push_back(track);
  }
  return result;
}

struct Resected {
  Rigid3d pose;
  int inliers = 0;
};

std::optional<Resected> solve(const FeatureGraph& graph, int frame, const Camera& camera,
                              const Correspondences& given, const std::vector<FeatureTrack>& tracks,
                              const ResectionOptions& options) {
  const int count = static_cast<int>(given.feature.size());
  if (count < options.min_inliers) return std::nullopt;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> plane;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d& x = tracks[at(given.track[at(i)])].position;
    points.emplace_back(x.x(), x.y(), x.z());
    const Eigen::Vector3d ray = camera.ray_of(graph.pixels[at(frame)].col(given.feature[at(i)]));
    // A pixel outside the lens model has no ray; far away it is an outlier like any other.
    plane.emplace_back(ray.allFinite() ? ray.x() : 1e3, ray.allFinite() ? ray.y() : 1e3);
  }
  cv::Mat rotation, translation;
  std::vector<int> inliers;
  const auto threshold = static_cast<float>(options.max_error_px * graph.pixel_scale / camera.fx);
  if (!cv::solvePnPRansac(points, plane, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotation,
                          translation, false, 5000, threshold, 0.9999, inliers, cv::SOLVEPNP_AP3P))
    return std::nullopt;
  const int agreed = static_cast<int>(inliers.size());
  if (agreed < options.min_inliers || agreed < options.min_inlier_ratio * count)
    return std::nullopt;
  std::vector<cv::Point3d> kept_points;
  std::vector<cv::Point2d> kept_plane;
  for (const int i : inliers) {
    kept_points.push_back(points[at(i)]);
    kept_plane.push_back(plane[at(i)]);
  }
  cv::solvePnPRefineLM(kept_points, kept_plane, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotation,
                       translation);
  Resected result;
  result.inliers = agreed;
  result.pose.rotation =
      turned_by({rotation.at<double>(0), rotation.at<double>(1), rotation.at<double>(2)});
  result.pose.translation = {translation.at<double>(0), translation.at<double>(1),
                             translation.at<double>(2)};
  if (!result.pose.is_finite()) return std::nullopt;
  return result;
}

/// Exact matches of the frames without a pose with every other.
void propose_all(FeatureGraph& graph, const std::vector<int>& missing) {
  std::set<ViewPair> wanted;
  for (const int m : missing)
    for (int f = 0; f < graph.count(); ++f)
      if (f != m) wanted.insert({std::min(f, m), std::max(f, m)});
  std::vector<ViewPair> pairs;
  for (const ViewPair& pair : wanted)
    if (!graph.proposed.contains(pair)) pairs.push_back(pair);
  std::vector<std::vector<FeatureMatch>> found(pairs.size());
  parallel_for(static_cast<int>(pairs.size()), [&](int p) {
    found[at(p)] = match_descriptors(graph.descriptors[at(pairs[at(p)].first)],
                                     graph.descriptors[at(pairs[at(p)].second)]);
  });
  for (std::size_t p = 0; p < pairs.size(); ++p) graph.proposed[pairs[p]] = std::move(found[p]);
}

/// Posed frames that look at the scene from most nearly the same side.
std::vector<int> nearest_posed(const PosedFrames& posed, int frame, std::size_t count) {
  std::vector<std::pair<double, int>> order;
  const auto axis = [&](int f) {
    return Eigen::Vector3d(posed.poses[at(f)]->rotation.conjugate() * Eigen::Vector3d::UnitZ());
  };
  for (int f = 0; f < static_cast<int>(posed.poses.size()); ++f)
    if (f != frame && posed.poses[at(f)]) order.emplace_back(-axis(f).dot(axis(frame)), f);
  std::sort(order.begin(), order.end());
  std::vector<int> nearest;
  for (std::size_t i = 0; i < std::min(count, order.size()); ++i)
    nearest.push_back(order[i].second);
  return nearest;
}

}  // namespace

Result<std::vector<int>> resect(FeatureGraph& graph, PosedFrames& posed,
                                const ResectionOptions& options, const Progress& progress) {
  std::vector<int> missing;
  for (int f = 0; f < graph.count(); ++f)
    if (!posed.poses[at(f)] && graph.pixels[at(f)].cols() >= options.min_inliers)
      missing.push_back(f);
  propose_all(graph, missing);
  TrackOptions track;
  track.max_error_px *= graph.pixel_scale;
  std::vector<int> added;
  while (!missing.empty()) {
    ORBITFUSE_TRY(progress.check("poses.resection"));
    const std::vector<FeatureTrack> tracks =
        triangulate_tracks(graph, graph.verified, posed, track);
    const auto track_of = index_of(tracks);
    std::optional<Resected> best;
    int frame = -1;
    for (const int m : missing) {
      const auto one = solve(graph, m, posed.cameras[at(m)], correspondences(graph, m, track_of),
                             tracks, options);
      if (one && (!best || one->inliers > best->inliers)) best = one, frame = m;
    }
    if (!best) break;
    posed.poses[at(frame)] = best->pose;
    std::erase(missing, frame);
    added.push_back(frame);
    constexpr std::size_t partners = 6;
    for (const int f : nearest_posed(posed, frame, partners)) {
      const ViewPair pair{std::min(f, frame), std::max(f, frame)};
      graph.verified[pair] = guided_matches(graph, pair, posed, 3 * graph.pixel_scale);
    }
  }
  return added;
}

std::optional<OtherPlace> place_by_others(const FeatureGraph& graph,
                                          const std::vector<FeatureTrack>& all_tracks,
                                          const PosedFrames& posed, int frame,
                                          const ResectionOptions& options) {
  const std::vector<FeatureTrack> tracks = without_frame(graph, posed, all_tracks, frame);
  const Camera& camera = posed.cameras[at(frame)];
  const auto miss_px = [&](const Rigid3d& pose, int feature, int t) {
    return (camera.project(pose * tracks[at(t)].position) - graph.pixels[at(frame)].col(feature))
        .norm();
  };
  const Rigid3d& here = *posed.poses[at(frame)];
  const Correspondences all = correspondences(graph, frame, index_of(tracks));
  Correspondences near;
  for (std::size_t i = 0; i < all.feature.size(); ++i) {
    constexpr double reach = 0.05;  // of the width; repeated structure fits elsewhere as well
    if (!(miss_px(here, all.feature[i], all.track[i]) <= reach * camera.width)) continue;
    near.feature.push_back(all.feature[i]);
    near.track.push_back(all.track[i]);
  }
  const auto found = solve(graph, frame, camera, near, tracks, options);
  if (!found) return std::nullopt;
  OtherPlace place{found->pose, 0, 0};
  for (std::size_t i = 0; i < near.feature.size(); ++i) {
    const double limit_px = options.max_error_px * graph.pixel_scale;
    place.agree_there += miss_px(found->pose, near.feature[i], near.track[i]) <= limit_px;
    place.agree_here += miss_px(here, near.feature[i], near.track[i]) <= limit_px;
  }
  return place;
}

std::optional<Rigid3d> resect_by_others(const FeatureGraph& graph,
                                        const std::vector<FeatureTrack>& all_tracks,
                                        const PosedFrames& posed, int frame,
                                        const ResectionOptions& options) {
  const auto place = place_by_others(graph, all_tracks, posed, frame, options);
  if (!place || place->agree_there < place->agree_here) return std::nullopt;
  return place->pose;
}

}  // namespace orbitfuse
