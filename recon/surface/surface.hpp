// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "core/progress.hpp"
#include "recon/surface/options.hpp"

// A mesh from depth maps of posed views: a truncated signed distance fused over the views (Curless
// and Levoy 1996, "A volumetric method for building complex models from range images"), its zero
// level by surface nets (Gibson 1998), loose pieces dropped, simplified by meshoptimizer, painted
// from the views that see each vertex. Lengths are in the unit of the poses.
namespace orbitfuse {

/// A view with the depth of what it sees.
struct SurfaceView {
  PosedView view;  ///< camera without distortion, of the map's size
  cv::Mat depth;   ///< CV_32FC1 along the optical axis; NaN, infinite or <= 0: unknown
};

/// The surface within the box, before it is cleaned and simplified: positions, triangles. Where no
/// view saw enough it has holes. Errors: usage (options), input (a box that is empty or not finite,
/// a map whose size or type differs from its camera's), quality (no surface in the box), cancelled.
Result<TriangleMesh> fuse_depth(const std::vector<SurfaceView>& views,
                                const Eigen::AlignedBox3d& box, const SurfaceOptions& options,
                                const Progress& progress);

/// Without the connected pieces whose bounding box has a diagonal below `least_size`, and without
/// triangles that have no area or a corner that is not finite. Attributes of vertices stay.
TriangleMesh without_small_pieces(const TriangleMesh& mesh, double least_size);

/// At most about `triangles` triangles (fewer where flat; more where its pieces can't lose any
/// without falling apart). Vertices that stay keep their place and attributes.
TriangleMesh simplified(const TriangleMesh& mesh, int triangles);

/// Area-weighted mean of the triangles' normals at each vertex; zero where there is none.
std::vector<Eigen::Vector3f> vertex_normals(const TriangleMesh& mesh);

/// The mesh as a camera without distortion sees it: CV_32FC1 depth along the optical axis, NaN
/// where nothing is. Triangles that reach behind the camera are left out.
cv::Mat mesh_depth(const TriangleMesh& mesh, const PosedView& view);

/// A picture that paints what it sees.
struct PaintView {
  PosedView view;  ///< camera without distortion, of the picture's size
  cv::Mat values;  ///< CV_32FC1 or CV_32FC3; a NaN channel: nothing is known there
};

struct Painted {
  std::vector<cv::Vec3f> values;  ///< one a vertex (CV_32FC1: all three alike); NaN: none sees it
  std::vector<int> views;         ///< how many views each vertex was painted by
};

/// The mean of the pictures at each vertex, weighted by the angle at which they see it; pictures
/// that the mesh itself hides it from, and those at more than `max_angle_deg`, don't count. A view
/// in which it lies beside an edge of the object counts little: there a pixel's error of pose shows
/// something else. Errors: input (a picture whose size or type is wrong), cancelled.
Result<Painted> paint(const TriangleMesh& mesh, const std::vector<PaintView>& views,
                      double max_angle_deg, const Progress& progress);

}  // namespace orbitfuse
