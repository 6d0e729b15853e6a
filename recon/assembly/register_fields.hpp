// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/point_cloud.hpp"
#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "recon/alignment/scene_renderer.hpp"
#include "recon/registration/register.hpp"
#include "recon/registration/similarity_refinement.hpp"

// Two fields in frames of their own: their point clouds say how the frames relate, to what the
// clouds' edges are blurred by, and up to a flip where the object is near-symmetric; the thermal
// images against renders of the visible field decide flips and say the rest.
namespace orbitfuse {

/// The thermal field's cloud and views, in the thermal frame.
struct ThermalEvidence {
  PointCloud cloud;
  std::vector<PosedView> views;
  std::vector<cv::Mat> images;  ///< CV_32FC1, one a view, of its camera's size
};

/// The visible field's cloud, and the field as alignment sees it, in the visible frame.
struct VisibleEvidence {
  PointCloud cloud;
  SceneRenderer renderer;
};

struct FieldRegistration {
  RegistrationReport clouds;    ///< target = visible, source = thermal
  SimilarityRefinement images;  ///< from the clouds' answer; holds it where it improves nothing
  const Similarity3d& visible_from_thermal() const { return images.visible_from_thermal; }
};

/// Errors: those of register_clouds and search_similarity, the renderer's, cancelled.
Result<FieldRegistration> register_fields(const ThermalEvidence& thermal,
                                          const VisibleEvidence& visible,
                                          const RegistrationOptions& options,
                                          const Progress& progress);

}  // namespace orbitfuse
