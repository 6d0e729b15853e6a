// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"

// Where the surface lies that a pixel shows, by all recorded views and not by that one alone: where
// a field puts glass, gloss or plain paint at another depth from each side, one view does not tell.
namespace orbitfuse::measurement {

/// Depth along the optical axis of what a camera sees: CV_32FC1 of its size, world units, NaN =
/// nothing there. Safe to call from several threads. Errors: the renderer's, cancelled.
using DepthRenderer =
    std::function<Result<cv::Mat>(const Camera&, const Rigid3d& cam_from_world, const Progress&)>;

/// What places are found in.
struct SurfaceSource {
  DepthRenderer depth;
  std::vector<PosedView> views;  ///< recorded, with sure poses
};

/// A place and how far off it may be (one standard deviation): across the ray that shows it and
/// along it.
struct Located {
  Eigen::Vector3d position = Eigen::Vector3d::Zero(), ray = Eigen::Vector3d::UnitZ();
  double across = 0, along = 0;
  bool confirmed = true;  ///< by a surface that two other views or more have there
  double variance_along(const Eigen::Vector3d& direction) const;
};

/// The distance between two places, in world units.
struct Apart {
  double length = 0, sigma = 0;  ///< one standard deviation
};
Apart apart(const Located& a, const Located& b);

/// The surface at a pixel of any posed camera. Input error where there is none (sky, a hole), or
/// the pixel lies outside of the picture or of what its lens is known to do; the renderer's.
Result<Located> located(const SurfaceSource& source, const PosedView& view,
                        const Eigen::Vector2d& pixel, const Progress& progress);

/// A point as it was given, as far off as the views that see a surface there are apart, and no
/// less than a share of the orbit's radius (NaN: not known how far): it was read off a picture or a
/// model. Errors: the renderer's.
Result<Located> located(const SurfaceSource& source, const Eigen::Vector3d& point, double radius,
                        const Progress& progress);

/// Input error: not finite, or beyond the surroundings of the cameras that stand `radius` round
/// `center`.
Status check_in_scene(const Eigen::Vector3d& point, const Eigen::Vector3d& center, double radius);

/// "pixel 212,340 of visible/000003.jpg", or an input error: it lies outside of the picture.
Result<std::string> pixel_words(const PosedView& view, const Eigen::Vector2d& pixel);

}  // namespace orbitfuse::measurement
