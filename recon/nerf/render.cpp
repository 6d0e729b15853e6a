// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/render.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.hpp"
#include "recon/nerf/ray_block.hpp"

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
  if (!(stop_transmittance > 0 && stop_transmittance < 0.5))
    return fail(ErrorKind::usage, "render.stop_transmittance", fmt::format("{}", stop_transmittance),
                "choose above 0 and below 0.5");
  if (!(sample_factor >= 0.1 && sample_factor <= 16))
    return fail(ErrorKind::usage, "render.sample_factor", fmt::format("{}", sample_factor),
                "choose 0.1..16");
  return {};
}

RenderedView render_strided(const FieldState& field, const ViewRays& rays, int stride,
                            const RenderOptions& options) {
  const Camera& camera = rays.camera();
  const int width = (camera.width + stride - 1) / stride, height = (camera.height + stride - 1) / stride;
  const int channels = field.channels();
  RenderedView view;
  view.color.create(height, width, CV_32FC(channels));
  view.depth.create(height, width, CV_32FC1);
  view.opacity.create(height, width, CV_32FC1);
  const Kernels& kernels = kernels_for(best_isa());
  MarchSettings settings = field.march_settings();
  settings.surface = static_cast<int>(std::lround(settings.surface * options.sample_factor));
  settings.haze = static_cast<int>(std::lround(settings.haze * options.sample_factor));
  const ForwardSettings limits{static_cast<float>(options.stop_transmittance), 1e-4f, false};
  parallel_blocks(width * height, rays_per_block, [&](int begin, int end) {
    thread_local RayBlock block;
    thread_local std::vector<int> pixels;
    block.clear();
    pixels.clear();
    for (int p = begin; p < end; ++p) {
      const int x = p % width, y = p / width;
      Ray ray;
      if (rays.ray(std::min(camera.width - 1, x * stride + stride / 2) + 0.5,
                   std::min(camera.height - 1, y * stride + stride / 2) + 0.5, ray)) {
        pixels.push_back(p);
        block.add(field, ray, settings, 0.5f);
      } else {  // outside the lens model's field of view
        std::fill_n(view.color.ptr<float>(y) + x * channels, channels, nan);
        view.depth.at<float>(y, x) = nan;
        view.opacity.at<float>(y, x) = 0;
      }
    }
    forward(field, kernels, limits, block);
    int row = 0;
    for (std::size_t r = 0; r < pixels.size(); ++r) {
      const int x = pixels[r] % width, y = pixels[r] / width;
      write_ray(field, block, static_cast<int>(r), row,
                {view.color.ptr<float>(y) + x * channels, view.depth.ptr<float>(y) + x,
                 view.opacity.ptr<float>(y) + x});
    }
  });
  return view;
}

double psnr_of(const FieldState& field, const SceneView& view, int stride) {
  const RenderedView image = render_strided(field, view.rays, stride, {});
  const int channels = field.channels();
  double sum = 0;
  long count = 0;
  for (int y = 0; y < image.color.rows; ++y)
    for (int x = 0; x < image.color.cols; ++x) {
      const int px = std::min(view.target.cols - 1, x * stride + stride / 2);
      const int py = std::min(view.target.rows - 1, y * stride + stride / 2);
      for (int c = 0; c < channels; ++c) {
        const float truth = view.target.ptr<float>(py)[px * channels + c];
        const float value = image.color.ptr<float>(y)[x * channels + c];
        if (!std::isfinite(truth) || !std::isfinite(value)) continue;
        const double error = std::clamp(value, 0.0f, 1.0f) - std::clamp(truth, 0.0f, 1.0f);
        sum += error * error;
        ++count;
      }
    }
  return count > 0 ? -10 * std::log10(std::max(1e-12, sum / static_cast<double>(count)))
                   : std::numeric_limits<double>::quiet_NaN();
}

Result<RenderedView> render(const Field& field, const Camera& camera,
                            const Rigid3d& cam_from_world, const RenderOptions& options,
                            const Progress& progress) {
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
