// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "recon/nerf/dataset.hpp"
#include "recon/nerf/field/space.hpp"
#include "recon/nerf/field/view_rays.hpp"

namespace orbitfuse::nerf {

/// One colour all round the object, as renders and cut-out photos have it: what shows it is empty,
/// so that silhouettes carve the space (a visual hull: Laurentini 1994) and no ray is drawn where
/// nothing is.
struct PlainBackground {
  cv::Vec3f color;
  /// Per view of the dataset, CV_8UC1: pixels from here to what isn't background, at most 255; 0 at
  /// the object. Background reaches in from the image's border: a patch of its colour inside the
  /// object is the object's.
  std::vector<cv::Mat> clearance_px;
  double share = 0;  ///< of all pixels
};

/// None unless nearly every visible view shows it along most of its border, within what 8 bits and
/// mild compression leave: a photographed wall or sky varies more.
std::optional<PlainBackground> find_plain_background(const Dataset& dataset);

/// The ball that the silhouettes leave of `space`; `space` itself where they leave something at its
/// edge, so that the object may go on beyond it, or nothing at all.
Space fit_to_silhouettes(const PlainBackground& background, const Dataset& dataset,
                         const Space& space);

struct Silhouette {
  const ViewRays* rays;
  const cv::Mat* clearance_px;
};
enum class Sighting { empty, matter, unseen };
/// Empty: to a tenth of the views that see a point, and to two of them at least, everything within
/// `radius` of it is background. A highlight as white as that takes the object from fewer. Unseen:
/// by half of the views, so that it is not what the orbit looks at.
Sighting sighting_of(const std::vector<Silhouette>& views, const float point[3], float radius);

}  // namespace orbitfuse::nerf
