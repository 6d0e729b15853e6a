// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/scene_views.hpp"

#include <algorithm>

#include "core/image/undistorted.hpp"
#include "core/system/trace.hpp"
#include "recon/alignment/keyframe_scene.hpp"
#include "recon/alignment/luminance.hpp"

namespace orbitfuse {

Result<cv::Mat> straight_luminance(const Session& session, const FrameRecord& frame,
                                   const Camera& lens) {
  ORBITFUSE_ASSIGN(const cv::Mat values, read_luminance(session, frame));
  return recorded_straight(equalised(values), lens, frame.file);
}

Result<SceneRenderer> scene_of(const VisibleScene& visible,
                               const Similarity3d& canonical_from_visible,
                               const Progress& progress) {
  /// Visible views that the scene is first rendered at: more would show the same from nearer by.
  constexpr int max_keyframes = 36;
  const TraceSpan span("keyframes of the visible field");
  std::vector<PosedView> views;
  const auto count = static_cast<int>(visible.reconstruction.views.size());
  const int kept = std::min(count, max_keyframes);
  for (int i = 0; i < kept; ++i)
    views.push_back(visible.reconstruction.views[static_cast<std::size_t>(i * count / kept)]);
  const Eigen::Vector3d center = canonical_from_visible.inverse() * Eigen::Vector3d::Zero();
  return keyframe_scene(visible.renderer, views, center, {}, progress);
}

}  // namespace orbitfuse
