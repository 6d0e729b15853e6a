// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/geometry/camera.hpp"
#include "core/geometry/reconstruction.hpp"
#include "core/geometry/transform.hpp"
#include "core/modality.hpp"
#include "core/result.hpp"

namespace orbitfuse::nerf {

/// One posed image to learn from. Lens distortion of `camera` is handled; nothing is resampled.
struct TrainingView {
  std::string name;  ///< names the file in errors
  Camera camera;     ///< at the image's own size
  Rigid3d cam_from_world;
  /// Visible: CV_32FC3 in R, G, B order, 0..1 as stored (sRGB). Thermal: CV_32FC1 kelvin, NaN =
  /// dead pixel, as cameras have some: it is left out, and a view of more than half NaN is dropped;
  /// train() names both. NaN in a visible image, which no camera makes, is an input error.
  cv::Mat image;
  /// Held out: measures, never trains. The field is the same without it, bit for bit, except that
  /// TrainOptions::keep_best chooses among its steps by what held-out views say.
  bool measure_only = false;
};

/// Everything known of one modality. All views, points and depth maps share one world frame; the
/// unit of length is free.
struct Dataset {
  Modality modality = Modality::visible;
  /// Thermal samples are 8-bit intensities, not temperatures. Each view may have been made by a
  /// curve of its own (training/gray_curves.hpp).
  bool thermal_is_gray = false;
  /// Of these: they are raw counts of one sensor, of one scale in all views but for its drift.
  bool counts = false;
  std::vector<TrainingView> views;
  std::vector<SparsePoint> points;  ///< optional; Observation::view indexes `views`
  std::vector<DepthMap> depth;      ///< optional; DepthMap::view indexes `views`

  double known_depth() const;  ///< share of the depth maps' pixels, without open sky
  /// Depth maps know enough of the scene to say where it is empty; below this they are like sparse
  /// points.
  bool has_dense_depth() const { return known_depth() > 0.1; }
  /// Names the view and the field that is malformed: sizes, types, cameras, poses, values.
  Status validate() const;
};

/// 8-bit BGR (image_io) to the layout TrainingView wants, resized by area averaging if asked.
cv::Mat rgb_of_bgr8(const cv::Mat& bgr8, cv::Size size = {});

/// A visible frame (as TrainingView::image) brought to the common exposure as training does:
/// divided by its gains, R, G, B; NaN where the camera clipped what that exposure would have shown.
void even_out(cv::Mat& image, const Eigen::Array3d& gain);

/// Square of a pixel's distance from the image's middle, in halves of its width.
double shading_r2(double x, double y, cv::Size size);

/// What a thermal lens' shading adds to an image of this size, kelvin (CV_32FC1): nothing in its
/// middle, `falloff_k` half a width beside it, and as the square of the distance.
cv::Mat shading_image(double falloff_k, cv::Size size);

/// Common levels at a view's own levels 0, 255/8 .. 255, straight between them (GrayCurves).
using GrayCurve = std::array<double, 9>;

/// A gray thermal view brought to the levels that all views share, as training does; NaN stays NaN.
cv::Mat to_common_levels(const cv::Mat& image, const GrayCurve& curve);

/// The view at another size: area-averaged image and matching camera.
TrainingView resized(const TrainingView& view, int width, int height);

}  // namespace orbitfuse::nerf
