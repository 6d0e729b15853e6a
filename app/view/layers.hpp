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

inline constexpr int most_divisor = 8;

struct LayerWish {
  bool visible = true, thermal = true, fused = true;
  /// All at this share of the shot's width, and the thermal field at that one where it is less: the
  /// picture comes sooner. The fused picture takes what there is.
  int divisor = 1, thermal_divisor = 1;
  /// Every pixel by its own ray, for what is kept; a picture to look at takes plain ones from their
  /// neighbours.
  bool every_pixel = false;
  /// With what recorded frames show beyond the fields. The first pictures from a new side take
  /// longer: the fields are rendered where the frames were recorded.
  bool detail = false;
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
  explicit LayerRenderer(const FinishedRun& run)
      : run_(run), details_{run.visible_detail, run.thermal_detail} {}

  /// Errors: as of RenderTurns::Job::turn; input (a pose that cannot be rendered).
  Result<Layers> render(const Shot& shot, const LayerWish& wish, RenderTurns::Job& job);

 private:
  using Plane = nerf::RenderedView;
  Result<Plane> plane(Modality modality, const Shot& shot, const LayerWish& wish,
                      RenderTurns::Job& job);
  Result<Plane> rendered(Modality modality, const Shot& shot, const LayerWish& wish,
                         RenderTurns::Job& job) const;
  Result<Plane> detailed(Modality modality, const Shot& shot, const LayerWish& wish,
                         RenderTurns::Job& job);
  Result<cv::Mat> fused(const cv::Mat& visible, const Plane& colors, const Plane& thermal) const;
  cv::Mat kelvin_of(const Plane& thermal) const;
  Rigid3d cam_from_field(Modality modality, const Shot& shot) const;
  const nerf::Field& field_of(Modality modality) const;

  const FinishedRun& run_;
  std::mutex mutex_;                               ///< of what follows
  std::list<std::pair<std::string, Plane>> kept_;  ///< newest first
  std::mutex detail_mutex_;
  nerf::PhotoDetail details_[2];  ///< visible, thermal
};

}  // namespace orbitfuse::view
