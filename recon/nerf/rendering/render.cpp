// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/rendering/render.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "core/option_range.hpp"
#include "core/system/parallel.hpp"
#include "recon/nerf/rendering/proposal.hpp"
#include "recon/nerf/rendering/ray_block.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int rays_per_block = 64;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

struct Output {
  float* color;
  float* depth;
  float* opacity;
};

void write_ray(const FieldState& field, const RayBlock& block, int r, int& row, const Output& out) {
  ray_value(field, block, r, row, out.color);
  const int begin = block.first[static_cast<std::size_t>(r)];
  const int used = block.used[static_cast<std::size_t>(r)];
  // Median depth: where half of the light is gone. It stays on a surface where a mean would float
  // between two.
  float depth = nan;
  for (int i = begin; i < begin + used; ++i)
    if (block.light[static_cast<std::size_t>(i)] < 0.5f) {
      const auto k = static_cast<std::size_t>(i);
      const float before = i > begin ? block.light[k - 1] : 1.0f;
      const float part = (before - 0.5f) / std::max(1e-6f, before - block.light[k]);
      depth = block.t[k] + (part - 0.5f) * block.dt[k];
      break;
    }
  *out.depth = depth * block.rays[static_cast<std::size_t>(r)].forward *
               static_cast<float>(field.space.radius);
  *out.opacity = used > 0 ? 1 - block.light[static_cast<std::size_t>(begin + used - 1)] : 0.0f;
}

}  // namespace

Status RenderOptions::validate() const {
  const OptionCheck check("render");
  ORBITFUSE_TRY(check("stop_transmittance", stop_transmittance, between(0, 0.5)));
  return check("sample_factor", sample_factor, from_to(0.1, 16));
}

namespace {

constexpr int limit_stride = 4;  // one ray of 16 looks ahead for its neighbours
constexpr float limit_margin = 1.03f;
constexpr float no_limit = std::numeric_limits<float>::max();

/// Renders the pixels of one image, block by block.
class ImageRenderer {
 public:
  ImageRenderer(const FieldState& field, const ViewRays& rays, int stride,
                const RenderOptions& options)
      : field_(field),
        rays_(rays),
        stride_(stride),
        kernels_(kernels_for(best_isa())),
        march_(field.march_settings()),
        limits_{static_cast<float>(options.stop_transmittance), 1e-4f, false} {
    const Camera& camera = rays.camera();
    width_ = (camera.width + stride - 1) / stride;
    height_ = (camera.height + stride - 1) / stride;
    march_.surface = static_cast<int>(std::lround(march_.surface * options.sample_factor));
    march_.haze = static_cast<int>(std::lround(march_.haze * options.sample_factor));
  }

  /// Where each ray has met what stops it; no_limit where nothing did.
  cv::Mat ends() {
    cv::Mat out(height_, width_, CV_32FC1, cv::Scalar(no_limit));
    parallel_blocks(width_ * height_, rays_per_block, [&](int begin, int end) {
      thread_local RayBlock block;
      thread_local std::vector<int> pixels;
      block.clear();
      pixels.clear();
      for (int p = begin; p < end; ++p) add(p, no_limit, pixels);
      place(block);
      forward(field_, kernels_, limits_, block);
      for (std::size_t r = 0; r < pixels.size(); ++r)
        if (stopped(block, static_cast<int>(r))) {
          const auto last = static_cast<std::size_t>(block.first[r] + block.used[r] - 1);
          out.at<float>(pixels[r] / width_, pixels[r] % width_) = block.t[last] + block.dt[last];
        }
    });
    return out;
  }

  /// `far`: per pixel how far to look first; a ray that isn't stopped by then looks on to the end.
  RenderedView image(const cv::Mat& far) {
    const int channels = field_.channels();
    RenderedView view;
    view.color.create(height_, width_, CV_32FC(channels));
    view.color.setTo(cv::Scalar::all(nan));  // stays outside the lens model's field of view
    view.depth.create(height_, width_, CV_32FC1);
    view.depth.setTo(nan);
    view.opacity = cv::Mat::zeros(height_, width_, CV_32FC1);
    parallel_blocks(width_ * height_, rays_per_block, [&](int begin, int end) {
      thread_local RayBlock block;
      thread_local std::vector<int> pixels, again;
      again.clear();
      for (const bool limited : {true, false}) {
        block.clear();
        pixels.clear();
        if (limited)
          for (int p = begin; p < end; ++p) add(p, far.at<float>(p / width_, p % width_), pixels);
        else
          for (const int p : again) add(p, no_limit, pixels);
        if (pixels.empty()) continue;
        place(block);
        forward(field_, kernels_, limits_, block);
        int row = 0;
        for (std::size_t r = 0; r < pixels.size(); ++r) {
          const int x = pixels[r] % width_, y = pixels[r] / width_;
          write_ray(field_, block, static_cast<int>(r), row,
                    {view.color.ptr<float>(y) + x * channels, view.depth.ptr<float>(y) + x,
                     view.opacity.ptr<float>(y) + x});
          if (limited && far.at<float>(y, x) < no_limit && !stopped(block, static_cast<int>(r)))
            again.push_back(pixels[r]);
        }
      }
    });
    return view;
  }

 private:
  void add(int pixel, float far, std::vector<int>& pixels) const {
    const Camera& camera = rays_.camera();
    const int x = pixel % width_ * stride_ + stride_ / 2,
              y = pixel / width_ * stride_ + stride_ / 2;
    Ray ray;
    if (!rays_.ray(std::min(camera.width - 1, x) + 0.5, std::min(camera.height - 1, y) + 0.5, ray))
      return;
    drawn().push_back({ray, far, 0.5f});
    pixels.push_back(pixel);
  }
  /// The samples of all rays that add() noted.
  void place(RayBlock& block) const {
    thread_local ProposalBlock proposals;
    if (proposing_)
      add_proposed(field_, kernels_, drawn(), {.near = march_.near}, proposals, block);
    else
      block.add(field_.occupancy, march_, drawn());
    drawn().clear();
  }
  static std::vector<DrawnRay>& drawn() {
    thread_local std::vector<DrawnRay> rays;
    return rays;
  }
  bool stopped(const RayBlock& block, int ray) const {
    const auto r = static_cast<std::size_t>(ray);
    return block.used[r] > 0 &&
           block.light[static_cast<std::size_t>(block.first[r] + block.used[r] - 1)] < limits_.stop;
  }

  const FieldState& field_;
  const ViewRays& rays_;
  int stride_, width_ = 0, height_ = 0;
  const Kernels& kernels_;
  MarchSettings march_;
  ForwardSettings limits_;
  bool proposing_ = field_.options.sampling == Sampling::proposal;
};

}  // namespace

RenderedView render_strided(const FieldState& field, const ViewRays& rays, int stride,
                            const RenderOptions& options) {
  ImageRenderer renderer(field, rays, stride, options);
  const int width = (rays.camera().width + stride - 1) / stride,
            height = (rays.camera().height + stride - 1) / stride;
  // Proposal networks know where surfaces are.
  if (!options.look_ahead || field.options.sampling == Sampling::proposal ||
      std::min(width, height) < 8 * limit_stride)
    return renderer.image(cv::Mat(height, width, CV_32FC1, cv::Scalar(no_limit)));
  // What lies behind opaque surfaces is half of most rays. Look where they are at a sixteenth of
  // the pixels; the farthest of the neighbours is the limit.
  const cv::Mat ends = ImageRenderer(field, rays, stride * limit_stride, options).ends();
  cv::Mat farthest, far;
  cv::dilate(ends, farthest, cv::Mat::ones(3, 3, CV_8U));
  cv::resize(farthest, far, {width, height}, 0, 0, cv::INTER_NEAREST);
  for (int y = 0; y < height; ++y)
    for (float *f = far.ptr<float>(y), *e = f + width; f != e; ++f)
      if (*f < no_limit) *f *= limit_margin;
  return renderer.image(far);
}

Result<RenderedView> render(const Field& field, const Camera& camera, const Rigid3d& cam_from_world,
                            const RenderOptions& options, const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(camera.validate("render.camera"));
  ORBITFUSE_TRY(progress.check("render"));
  if (field.empty())
    return fail(ErrorKind::input, "field", "it is empty", "train or load it first");
  if (!cam_from_world.is_finite())
    return fail(ErrorKind::input, "render.pose", "not finite", "give a valid pose");
  const FieldState& state = field.state();
  RenderedView view =
      render_strided(state, ViewRays(camera, cam_from_world, state.space), 1, options);
  if (state.modality == Modality::thermal)
    view.color = view.color * (state.span.high - state.span.low) + state.span.low;
  return view;
}

}  // namespace orbitfuse::nerf
