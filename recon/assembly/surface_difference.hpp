// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry/transform.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "core/progress.hpp"
#include "recon/assembly/field_surface.hpp"

// Two inspections of one object: how much warmer its surface has become, and where it is not the
// same surface any more. Both thermal fields are rendered from the cameras of both orbits; where
// their depths agree they show one surface, whose temperatures are compared pixel by pixel; where
// the earlier field lets the ray pass, something stands that did not.
namespace orbitfuse {

struct SurfaceDifferenceOptions {
  int width_px = 320;  ///< of the pictures that are compared
  /// Shares of the distance: depths that differ by less show one surface, by more another one.
  /// Between them neither is said: a field's depth is good to half a percent, on gloss to two.
  double same_depth = 0.01, changed_depth = 0.02;
  /// Of a place's views that must see another surface.
  double changed_share = 0.5;
  int least_views = 3;  ///< that say so: where one or two see anything, fields make it up
  double max_angle_deg = 75;  ///< flatter, a pixel's error of pose shows something else
  Status validate() const;
};

enum class SurfaceChange : std::uint8_t {
  same,     ///< both saw this surface
  changed,  ///< the other one saw through it: moved here, or of another form
  unseen,   ///< too few views of both show it
};

/// Of each vertex of the mesh.
struct SurfaceDifference {
  std::vector<SurfaceChange> change;
  std::vector<float> difference_k;  ///< scene less other; NaN unless `same`
  std::vector<float> spread_k;      ///< between the views that show it
};

/// Both scenes as one camera sees them.
struct DifferencePicture {
  PosedView view;        ///< without distortion, of the picture's size
  cv::Mat difference_k;  ///< CV_32FC1: scene less other where both show one surface, else NaN
  cv::Mat only_here;     ///< CV_8UC1: 255 where the other one saw through this surface
  cv::Mat only_there;    ///< CV_8UC1: 255 where the other one's surface stands before
};

/// `world_from_other` brings the other scene into the world of `scene` and of `view`. Errors: usage
/// (options), input (no thermal field or view), cancelled, the renderer's.
Result<DifferencePicture> difference_picture(const PosedView& view, const SurfaceFields& scene,
                                             const SurfaceFields& other,
                                             const Similarity3d& world_from_other,
                                             const SurfaceDifferenceOptions& options,
                                             const Progress& progress);

/// From all thermal cameras of both. Errors: as there.
Result<std::vector<DifferencePicture>> difference_pictures(const SurfaceFields& scene,
                                                           const SurfaceFields& other,
                                                           const Similarity3d& world_from_other,
                                                           const SurfaceDifferenceOptions& options,
                                                           const Progress& progress);

/// The same pictures as the other scene has them, in its own world.
std::vector<DifferencePicture> seen_from_other(const std::vector<DifferencePicture>& pictures,
                                               const Similarity3d& world_from_other);

/// `mesh`: of the pictures' scene, in their world. Errors: usage (options), cancelled.
Result<SurfaceDifference> surface_difference(const TriangleMesh& mesh,
                                             const std::vector<DifferencePicture>& pictures,
                                             const SurfaceDifferenceOptions& options,
                                             const Progress& progress);

}  // namespace orbitfuse
