// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "core/result.hpp"
#include "core/session/session.hpp"

// Straight pieces of image edges, triangulated between the posed visible views. Edges of form
// (corners, outlines, joints) show in both modalities whatever their contrast; edges of paint
// don't, and are clutter that the robust scores downstream live with. No texture is needed on the
// surfaces between them, and a segment is localised to a fraction of a pixel.
namespace orbitfuse {

struct ImageSegment {
  Eigen::Vector2d a, b;  ///< normalised, undistorted image coordinates
  double length_px = 0;
};

struct EdgeLine {
  Eigen::Vector3d a, b;
  std::vector<int> views;  ///< indices of the views that show it, ascending
};

struct EdgeLineOptions {
  int max_image_side_px = 800;
  double min_length_px = 14;
  int max_segments_per_view = 700;
  /// Views whose directions differ by more are not matched.
  double max_view_angle_deg = 65;
  /// A view confirms a line whose projection it meets within this distance and angle.
  double max_distance_px = 1.5;
  double max_angle_deg = 3;
  /// Two views always meet in some line: a third is the first evidence.
  int min_views = 3;
};

/// Line segments of each view (LSD, von Gioi et al. 2010).
std::vector<ImageSegment> detect_segments(const cv::Mat& gray, const Camera& camera,
                                          const EdgeLineOptions& options);

/// Lines confirmed by at least min_views views, most confirmed first; duplicates merged.
std::vector<EdgeLine> triangulate_lines(const std::vector<PosedView>& views,
                                        const std::vector<std::vector<ImageSegment>>& segments,
                                        const EdgeLineOptions& options);

/// Both steps on the session's images.
Result<std::vector<EdgeLine>> visible_edge_lines(const Session& session,
                                                 const Reconstruction& visible,
                                                 const EdgeLineOptions& options,
                                                 const Progress& progress);

}  // namespace orbitfuse
