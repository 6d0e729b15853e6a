// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "recon/alignment/scene_renderer.hpp"

// Patches of a thermal view found again in its neighbours. What a neighbour measured is first drawn
// as the view would see it, by the visible scene's depth, so that a plain correlation finds patches
// to a fraction of a pixel over turns of 50 degrees. Internal to recon/poses.
namespace orbitfuse {

struct ThermalTrackOptions {
  int neighbours = 7;  ///< that each view is compared with, the least turned first
  /// A neighbour turned by less shows little that the view's own noise does not, one turned by more
  /// sees other surfaces.
  double min_turn_deg = 8, max_turn_deg = 55;
  int max_patches = 220;  ///< of a view
  int radius_px = 7;      ///< of a patch, at most 7: its rows are summed 16 pixels at once
  int reach_px = 6;       ///< of the search about where the poses have it
  double min_correlation = 0.8;
  double min_painted = 0.8;  ///< share of a patch
  double depth_tolerance = 0.03;
};

/// Posed thermal images of one size, with the visible scene's depth from their places.
struct ThermalViews {
  Camera camera;  ///< of all, without distortion
  std::vector<Rigid3d> cam_from_world;
  std::vector<cv::Mat> images, depth;  ///< CV_32FC1; no depth: NaN
};

/// A place as one view sees it.
struct ThermalSighting {
  std::size_t view = 0;
  Eigen::Vector2d pixel;
  Eigen::Matrix2d sqrt_weight = Eigen::Matrix2d::Identity();  ///< along an edge little is known
};

/// A place on the surface, and the views that show it: the first is where it was taken from.
struct ThermalTrack {
  Eigen::Vector3d surface;  ///< world
  Eigen::Vector3d sight;    ///< unit direction from the first view
  double distance = 0;      ///< from there
  std::vector<ThermalSighting> sightings;
};

/// Tracks from each of the chosen views to those of `others` that see the same; none where images
/// are flat or see nothing of each other.
std::vector<ThermalTrack> thermal_tracks(const ThermalViews& views,
                                         const std::vector<std::size_t>& chosen,
                                         const std::vector<std::size_t>& others,
                                         const ThermalTrackOptions& options);

}  // namespace orbitfuse
