// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/measure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "recon/nerf/rendering/render.hpp"

namespace orbitfuse::nerf {
namespace {

/// Every n-th pixel of a row and column measures: a thousand or more of an image.
int measuring_stride(const cv::Mat& image) {
  return std::clamp(static_cast<int>(std::sqrt(static_cast<double>(image.total()) / 1200)), 1, 4);
}

}  // namespace

double psnr_of(const RenderedView& picture, const cv::Mat& target, int stride) {
  const int channels = target.channels();
  double sum = 0;
  long count = 0;
  for (int y = 0; y < picture.color.rows; ++y)
    for (int x = 0; x < picture.color.cols; ++x) {
      const int px = std::min(target.cols - 1, x * stride + stride / 2);
      const int py = std::min(target.rows - 1, y * stride + stride / 2);
      for (int c = 0; c < channels; ++c) {
        const float truth = target.ptr<float>(py)[px * channels + c];
        const float value = picture.color.ptr<float>(y)[x * channels + c];
        if (!std::isfinite(truth) || !std::isfinite(value)) continue;
        const double error = std::clamp(value, 0.0f, 1.0f) - std::clamp(truth, 0.0f, 1.0f);
        sum += error * error;
        ++count;
      }
    }
  return count > 0 ? -10 * std::log10(std::max(1e-12, sum / static_cast<double>(count)))
                   : std::numeric_limits<double>::quiet_NaN();
}

PoseSums sums_of(const RenderedView& picture, int stride, const Space& space,
                 const NormalisedView& view) {
  PoseSums sums;
  const int channels = picture.color.channels();
  for (int y = 0; y < picture.depth.rows; ++y)
    for (int x = 0; x < picture.depth.cols; ++x) {
      const int px = std::min(view.target.cols - 1, x * stride + stride / 2);
      const int py = std::min(view.target.rows - 1, y * stride + stride / 2);
      Ray ray;
      const float z = picture.depth.at<float>(y, x);
      if (!std::isfinite(z) || !view.rays.ray(px + 0.5, py + 0.5, ray)) continue;
      add_ray(view, px, py, picture.color.ptr<float>(y) + x * channels,
              z / ray.forward / static_cast<float>(space.radius), sums);
    }
  return sums;
}

double heldout_psnr(FieldState& field, std::vector<NormalisedView>& views,
                    const std::vector<bool>& heldout, bool align) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!heldout[i]) continue;
    const int stride = measuring_stride(views[i].target);
    RenderedView picture = render_strided(field, views[i].rays, stride, {});
    for (int turn = 0; align && turn < 3; ++turn) {
      if (!take_step(sums_of(picture, stride, field.space, views[i]), field.space,
                     field.refined_poses[i], views[i]))
        break;
      picture = render_strided(field, views[i].rays, stride, {});
    }
    sum += psnr_of(picture, views[i].target, stride);
    ++count;
  }
  return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

double peak_db(const std::vector<CurvePoint>& curve) {
  double peak = -std::numeric_limits<double>::infinity();
  for (const CurvePoint& point : curve)
    if (std::isfinite(point.heldout_psnr)) peak = std::max(peak, point.heldout_psnr);
  return peak;
}

bool fell(const std::vector<CurvePoint>& curve) {
  // .1 dB on a run of `container`, whose noisier field of step 1800 was taken for that of step
  // 2400: .11 K farther from the frames.
  constexpr double varies_db = 0.3;
  return curve.empty() || !(curve.back().heldout_psnr >= peak_db(curve) - varies_db);
}

}  // namespace orbitfuse::nerf
