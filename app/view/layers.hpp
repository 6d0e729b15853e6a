// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <list>
#include <mutex>
#include <opencv2/core.hpp>
#include <string>
#include <utility>

#include "app/view/finished_run.hpp"
#include "app/view/render_turns.hpp"

namespace orbitfuse::view {

/// A camera of the viewer, in the run's frame; without distortion.
struct Shot {
  Camera camera;
  Rigid3d cam_from_world;
};

struct LayerWish {
  bool visible = true, thermal = true, fused = true;
  /// The thermal field at a share of the width: thermal cameras see less, and the picture comes
  /// sooner. The fused picture takes what there is.
  int thermal_divisor = 1;
};

/// What a shot shows; a layer that was not wished, or has no field, is empty.
struct Layers {
  cv::Mat visible;  ///< CV_8UC3, BGR
  cv::Mat kelvin;   ///< CV_32FC1, NaN = no temperature there; gray levels of a gray run
  cv::Mat fused;    ///< CV_8UC3, BGR
};

/// Renders both fields from anywhere, one piece at a time, and keeps the last pictures.
class LayerRenderer {
 public:
  /// The run must outlive it.
  explicit LayerRenderer(const FinishedRun& run) : run_(run) {}

  /// Errors: as of RenderTurns::Job::turn; input (a pose that cannot be rendered).
  Result<Layers> render(const Shot& shot, const LayerWish& wish, RenderTurns::Job& job);

 private:
  /// One field's picture: colours as bytes, or temperatures.
  struct Plane {
    cv::Mat image, opacity;
  };
  Result<Plane> plane(Modality modality, const Shot& shot, RenderTurns::Job& job);
  Result<Plane> rendered(Modality modality, const Shot& shot, RenderTurns::Job& job) const;
  Result<cv::Mat> fused(const Plane& visible, const Plane& thermal) const;

  const FinishedRun& run_;
  std::mutex mutex_;
  std::list<std::pair<std::string, Plane>> kept_;  ///< newest first
};

}  // namespace orbitfuse::view
