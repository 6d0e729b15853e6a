// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/rendering/render.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "core/option_range.hpp"
#include "core/system/parallel.hpp"
#include "recon/nerf/device/on_device.hpp"
#include "recon/nerf/rendering/alike_neighbours.hpp"
#include "recon/nerf/rendering/trace_rays.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int limit_stride = 4;  // one ray of 16 looks ahead for its neighbours
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

}  // namespace

Status RenderOptions::validate() const {
  const OptionCheck check("render");
  ORBITFUSE_TRY(check("stop_transmittance", stop_transmittance, between(0, 0.5)));
  ORBITFUSE_TRY(check("alike", alike, from_to(0, 0.5)));
  ORBITFUSE_TRY(check("surface_light", surface_light, from_to(0.5, 0.95)));
  if (alike_px != 2 && alike_px != limit_stride)
    return fail(ErrorKind::usage, "render.alike_px", std::to_string(alike_px), "must be 2 or 4");
  return check("sample_factor", sample_factor, from_to(0.1, 16));
}

namespace {

constexpr float limit_margin = 1.03f;
/// Of the samples, for a ray that looks where its neighbours ended: most of the way has been looked
/// at. With all of them such pictures are nearer to finely sampled ones than those whose every
/// pixel is rendered, and a seventh dearer.
constexpr double between_share = 0.7;
constexpr float no_limit = no_end;

/// How far to look: a little behind the farthest of what one ray of each square of limit_stride
/// pixels and its neighbours met.
cv::Mat limits_from(const cv::Mat& ends, cv::Size size) {
  cv::Mat farthest, far(size, CV_32FC1);
  cv::dilate(ends, farthest, cv::Mat::ones(3, 3, CV_8U));
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const float end = farthest.at<float>(std::min(y / limit_stride, ends.rows - 1),
                                           std::min(x / limit_stride, ends.cols - 1));
      far.at<float>(y, x) = end < no_limit ? limit_margin * end : no_limit;
    }
  return far;
}

/// Where on its ray each pixel looks, or where its light faded: from `near` (0: all the way) to
/// `far` (no_limit: it never ends).
struct Reach {
  cv::Mat near, far;

  explicit Reach(cv::Size size)
      : near(cv::Mat::zeros(size, CV_32FC1)), far(size, CV_32FC1, cv::Scalar(no_limit)) {}
};

/// Renders the pixels of one image, block by block.
class ImageRenderer {
 public:
  ImageRenderer(const FieldState& field, const ViewRays& rays, int stride,
                const RenderOptions& options)
      : field_(field),
        rays_(rays),
        stride_(stride),
        march_(field.march_settings()),
        limits_{static_cast<float>(options.stop_transmittance), 1e-4f, false,
                static_cast<float>(options.surface_light)} {
    const Camera& camera = rays.camera();
    width_ = (camera.width + stride - 1) / stride;
    height_ = (camera.height + stride - 1) / stride;
    march_.surface = static_cast<int>(std::lround(march_.surface * options.sample_factor));
    march_.haze = static_cast<int>(std::lround(march_.haze * options.sample_factor));
    between_ = march_;
    between_.surface = static_cast<int>(std::lround(between_share * between_.surface));
    between_.haze = static_cast<int>(std::lround(between_share * between_.haze));
  }

  /// Where each ray has met what stops it; no_limit where nothing did.
  cv::Mat ends() {
    cv::Mat out(height_, width_, CV_32FC1, cv::Scalar(no_limit));
    std::vector<TracedRay> traced(static_cast<std::size_t>(width_ * height_));
    trace_rays(
        field_, limits_, march_, width_ * height_,
        [&](int p, DrawnRay& ray) { return ray_at(p, 0, no_limit, ray); }, traced.data());
    for (int p = 0; p < width_ * height_; ++p)
      if (const TracedRay& ray = traced[static_cast<std::size_t>(p)]; ray.there)
        out.at<float>(p / width_, p % width_) = ray.end;
    return out;
  }

  RenderedView empty_view() const {
    RenderedView view;
    view.color.create(height_, width_, CV_32FC(field_.channels()));
    view.color.setTo(cv::Scalar::all(nan));  // stays outside the lens model's field of view
    view.depth.create(height_, width_, CV_32FC1);
    view.depth.setTo(nan);
    view.opacity = cv::Mat::zeros(height_, width_, CV_32FC1);
    return view;
  }

  /// `far`: per pixel how far to look first; a ray that isn't stopped by then looks on to the end.
  RenderedView image(const cv::Mat& far) {
    RenderedView view = empty_view();
    std::vector<int> all(static_cast<std::size_t>(width_ * height_));
    std::iota(all.begin(), all.end(), 0);
    Reach look(far.size());
    look.far = far;
    render(all, look, view, nullptr, march_);
    return view;
  }

  /// Every pixel of a grid `options.alike_px` apart, and of the rest, in rounds that halve the
  /// distance, those whose neighbours aren't alike; these are their mean. So are the pixels that
  /// look ahead for the others: what they saw was sampled too thinly.
  RenderedView sparse_image(const RenderOptions& options) {
    RenderedView view = empty_view();
    Reach look(view.depth.size()), met(view.depth.size());  // not copies: these share their planes
    const auto looks = [](int x, int y) { return x % limit_stride == 0 && y % limit_stride == 0; };
    render(pixels_where(looks), look, view, &met, march_);
    look.far = limits_from(every_fourth(met.far), look.far.size());
    const bool wide = options.alike_px == limit_stride;
    const auto even = [](int x, int y) { return x % 2 == 0 && y % 2 == 0; };
    render(pixels_where([&](int x, int y) {
             if (!inside(x, y, 1) || (wide && looks(x, y))) return true;
             return even(x, y) && (wide ? !inside(x, y, 2) : !looks(x, y) || !inside(x, y, 2));
           }),
           look, view, &met, march_);
    Rest rest{options, look, met, view};
    if (wide) {
      complete(rest, diagonal_by_two, 2, [](int x, int y) { return x % 4 == 2 && y % 4 == 2; });
      complete(rest, beside_by_two, 2,
               [&](int x, int y) { return even(x, y) && (x + y) % 4 == 2; });
    } else {
      complete(rest, beside_by_two, 2, looks);
    }
    complete(rest, diagonal, 1, [](int x, int y) { return x % 2 == 1 && y % 2 == 1; });
    complete(rest, beside, 1, [](int x, int y) { return (x + y) % 2 == 1; });
    return view;
  }

 private:
  /// What the later rounds of sparse_image() go on with.
  struct Rest {
    const RenderOptions& options;
    Reach& look;
    Reach& met;
    RenderedView& view;
  };
  /// The chosen pixels: of their neighbours where these are alike, else each by its own ray.
  template <typename Chosen>
  void complete(Rest& rest, const Neighbours& neighbours, int margin, const Chosen& chosen) {
    constexpr int rows_per_block = 8;
    const auto alike = static_cast<float>(rest.options.alike);
    const auto blocks = static_cast<std::size_t>((height_ + rows_per_block - 1) / rows_per_block);
    std::vector<std::vector<int>> unlike(blocks), on_something(blocks);
    parallel_blocks(height_, rows_per_block, [&](int begin, int end) {
      const auto block = static_cast<std::size_t>(begin / rows_per_block);
      for (int y = begin; y < end; ++y)
        for (int x = 0; x < width_; ++x) {
          if (!inside(x, y, margin) || !chosen(x, y)) continue;
          const int p = y * width_ + x;
          const bool ends = rest.options.between_neighbours && look_between(rest, p, neighbours);
          if (!take_mean(rest.view, x, y, neighbours, alike))
            (ends ? on_something : unlike)[block].push_back(p);
        }
    });
    for (const auto* lists : {&unlike, &on_something}) {
      std::vector<int> all;
      for (const std::vector<int>& some : *lists) all.insert(all.end(), some.begin(), some.end());
      render(all, rest.look, rest.view, &rest.met, lists == &unlike ? march_ : between_);
    }
  }

  /// A ray between four that end on something looks where their light faded, and a little round it.
  /// False: they don't.
  bool look_between(Rest& rest, int pixel, const Neighbours& of) const {
    const int x = pixel % width_, y = pixel / width_;
    float near = no_limit, far = 0;
    for (const auto& [dx, dy] : of) {
      near = std::min(near, rest.met.near.at<float>(y + dy, x + dx));
      far = std::max(far, rest.met.far.at<float>(y + dy, x + dx));
    }
    rest.met.near.at<float>(y, x) = near;  // stands unless the pixel is rendered
    rest.met.far.at<float>(y, x) = far;
    if (!(far < no_limit)) return false;
    rest.look.near.at<float>(y, x) = near / limit_margin;
    rest.look.far.at<float>(y, x) = far * limit_margin;
    return true;
  }

  /// The listed pixels, each by its own ray; `met`: where their light faded.
  void render(const std::vector<int>& wanted, const Reach& look, RenderedView& view, Reach* met,
              const MarchSettings& march) {
    constexpr std::size_t at_once = 1 << 17;  // what their rays show is held until it is written
    std::vector<int> strip;
    for (std::size_t begin = 0; begin < wanted.size(); begin += at_once) {
      const std::size_t end = std::min(wanted.size(), begin + at_once);
      strip.assign(wanted.begin() + static_cast<std::ptrdiff_t>(begin),
                   wanted.begin() + static_cast<std::ptrdiff_t>(end));
      render_strip(strip, look, view, met, march);
    }
  }

  void render_strip(const std::vector<int>& wanted, const Reach& look, RenderedView& view,
                    Reach* met, const MarchSettings& march) {
    const auto at = [&](const cv::Mat& plane, int p) {
      return plane.at<float>(p / width_, p % width_);
    };
    std::vector<TracedRay> traced(wanted.size());
    trace_rays(
        field_, limits_, march, static_cast<int>(wanted.size()),
        [&](int i, DrawnRay& ray) {
          const int p = wanted[static_cast<std::size_t>(i)];
          return ray_at(p, at(look.near, p), at(look.far, p), ray);
        },
        traced.data());
    write(wanted, traced, view, met);
    std::vector<int> again;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      const TracedRay& ray = traced[i];
      const bool passed = ray.end == no_limit && at(look.far, wanted[i]) < no_limit,
                 late = ray.starts_dark && at(look.near, wanted[i]) > 0;
      if (ray.there && (passed || late)) again.push_back(wanted[i]);
    }
    trace_rays(
        field_, limits_, march_, static_cast<int>(again.size()),
        [&](int i, DrawnRay& ray) {
          return ray_at(again[static_cast<std::size_t>(i)], 0, no_limit, ray);
        },
        traced.data());
    write(again, traced, view, met);
  }

  void write(const std::vector<int>& pixels, const std::vector<TracedRay>& traced,
             RenderedView& view, Reach* met) const {
    const int channels = field_.channels();
    const auto radius = static_cast<float>(field_.space.radius);
    constexpr int block = 4096;
    parallel_blocks(static_cast<int>(pixels.size()), block, [&](int begin, int end) {
      for (int i = begin; i < end; ++i) {
        const TracedRay& ray = traced[static_cast<std::size_t>(i)];
        if (!ray.there) continue;
        const int pixel = pixels[static_cast<std::size_t>(i)];
        const int x = pixel % width_, y = pixel / width_;
        std::copy_n(ray.value, channels, view.color.ptr<float>(y) + x * channels);
        view.depth.at<float>(y, x) = ray.distance * ray.forward * radius;
        view.opacity.at<float>(y, x) = ray.opacity;
        if (met == nullptr) continue;
        met->far.at<float>(y, x) = ray.end;
        met->near.at<float>(y, x) = ray.begin;
      }
    });
  }

  bool inside(int x, int y, int margin) const {
    return x >= margin && y >= margin && x + margin < width_ && y + margin < height_;
  }
  template <typename Chosen>
  std::vector<int> pixels_where(const Chosen& chosen) const {
    std::vector<int> pixels;
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x)
        if (chosen(x, y)) pixels.push_back(y * width_ + x);
    return pixels;
  }
  static cv::Mat every_fourth(const cv::Mat& ends) {
    cv::Mat coarse((ends.rows + limit_stride - 1) / limit_stride,
                   (ends.cols + limit_stride - 1) / limit_stride, CV_32FC1);
    for (int y = 0; y < coarse.rows; ++y)
      for (int x = 0; x < coarse.cols; ++x)
        coarse.at<float>(y, x) = ends.at<float>(y * limit_stride, x * limit_stride);
    return coarse;
  }

  bool ray_at(int pixel, float near, float far, DrawnRay& out) const {
    const Camera& camera = rays_.camera();
    const int x = pixel % width_ * stride_ + stride_ / 2,
              y = pixel / width_ * stride_ + stride_ / 2;
    out = {{}, near, far, 0.5f};
    return rays_.ray(std::min(camera.width - 1, x) + 0.5, std::min(camera.height - 1, y) + 0.5,
                     out.ray);
  }

  const FieldState& field_;
  const ViewRays& rays_;
  int stride_, width_ = 0, height_ = 0;
  MarchSettings march_, between_;
  ForwardSettings limits_;
};

}  // namespace

RenderedView render_strided(const FieldState& field, const ViewRays& rays, int stride,
                            const RenderOptions& options) {
  ImageRenderer renderer(field, rays, stride, options);
  const int width = (rays.camera().width + stride - 1) / stride,
            height = (rays.camera().height + stride - 1) / stride;
  if (options.alike > 0) return renderer.sparse_image(options);
  // Proposal networks know where surfaces are.
  if (!options.look_ahead || field.options.sampling == Sampling::proposal ||
      std::min(width, height) < 8 * limit_stride)
    return renderer.image(cv::Mat(height, width, CV_32FC1, cv::Scalar(no_limit)));
  // What lies behind opaque surfaces is half of most rays. Look where they are at a sixteenth of
  // the pixels.
  const cv::Mat ends = ImageRenderer(field, rays, stride * limit_stride, options).ends();
  return renderer.image(limits_from(ends, {width, height}));
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
  RenderedView view;
  try {
    view = render_strided(state, ViewRays(camera, cam_from_world, state.space), 1, options);
  } catch (const device::Refused& refused) {
    return tl::unexpected(device::error_of(refused));
  }
  if (state.modality == Modality::thermal)
    view.color = view.color * (state.span.high - state.span.low) + state.span.low;
  return view;
}

}  // namespace orbitfuse::nerf
