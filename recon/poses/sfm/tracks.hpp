// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "recon/poses/sfm/feature_graph.hpp"

namespace orbitfuse {

/// One scene point and the features that show it.
struct FeatureTrack {
  Eigen::Vector3d position;
  std::vector<std::pair<int, int>> features;  ///< frame, feature
};

struct TrackOptions {
  double max_error_px = 4;  ///< recorded pixels; a feature that misses by more is left out
  double min_angle_deg = 1.5;
};

/// Views of a graph with a pose and the lens that goes with it.
struct PosedFrames {
  FramePoses poses;
  std::vector<Camera> cameras;
};

/// Matches joined to tracks among the posed frames, each triangulated from the two of its features
/// that most of the others agree with; a frame that a track shows twice is left out of it.
std::vector<FeatureTrack> triangulate_tracks(const FeatureGraph& graph, const PairMatches& matches,
                                             const PosedFrames& posed, const TrackOptions& options);

/// The tracks as the other frames alone place them; those that `frame` shared with one other go.
std::vector<FeatureTrack> without_frame(const FeatureGraph& graph, const PosedFrames& posed,
                                        std::vector<FeatureTrack> tracks, int frame);

/// A point seen along two rays: nullopt where they meet at less than `min_angle_deg` or behind.
std::optional<Eigen::Vector3d> meet(const Rigid3d& first, const Eigen::Vector3d& first_ray,
                                    const Rigid3d& second, const Eigen::Vector3d& second_ray,
                                    double min_angle_deg);

/// How many of `graph.proposed` the poses can mean, as tracks: features but one of each.
int explained_matches(const FeatureGraph& graph, const PosedFrames& posed);

/// Frames and tracks as views and points; frames without a pose are left out.
Reconstruction reconstruction_of(const FeatureGraph& graph, const PosedFrames& posed,
                                 const std::vector<FeatureTrack>& tracks, Modality modality);

/// The poses and lenses of a model's views, by the graph's frames; others keep their prior lens, or
/// that of a posed view of the same device and size.
PosedFrames posed_frames(const FeatureGraph& graph, const Reconstruction& model);

/// The band of `half_width_px` (recorded) about the epipolar lines of a pair's poses.
EpipolarBand epipolar_band(const FeatureGraph& graph, const ViewPair& pair,
                           const PosedFrames& posed, double half_width_px);

/// Proposed matches of posed frames that lie on the epipolar lines of their poses.
PairMatches confirmed_matches(const FeatureGraph& graph, const PosedFrames& posed,
                              double max_error_px);

/// Matches of a pair that lie within `band_px` (recorded) of their epipolar lines, once both poses
/// are known.
std::vector<FeatureMatch> guided_matches(const FeatureGraph& graph, const ViewPair& pair,
                                         const PosedFrames& posed, double band_px);

}  // namespace orbitfuse
