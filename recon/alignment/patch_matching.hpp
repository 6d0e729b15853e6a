// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "recon/alignment/scene_renderer.hpp"

namespace orbitfuse {

/// A rendered patch found in an image.
struct PatchMatch {
  Eigen::Vector3d point;  ///< in the rendering camera
  Eigen::Vector2d seen;   ///< pixel of the image
  Eigen::Matrix2d
      sqrt_weight;  ///< root of the peak's curvature, largest part 1: along an edge little is known
  double score = 0;  ///< normalised correlation at the peak
};

struct PatchMatchOptions {
  int search_px = 20, patch_search_px = 8, radius_px = 10, spacing_px = 8;
  double min_score = 0.35;
};

/// Edges of brightness and of depth of one render, sign-free (see edge_field.hpp); those of depth
/// count more.
cv::Mat rendered_edges(const SceneRender& render);

/// `edges`: rendered_edges; `field`: orientation_field of the image at the same size.
std::vector<PatchMatch> match_patches(const SceneRender& render, const cv::Mat& edges,
                                      const Camera& camera, const cv::Mat& field,
                                      const PatchMatchOptions& options);

/// Mean agreement of the rendered edges with the image's, -1..1.
double edge_agreement(const cv::Mat& edges, const cv::Mat& field);

}  // namespace orbitfuse
