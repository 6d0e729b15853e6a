// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/rendering/render.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
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
  ORBITFUSE_TRY(check("alike", alike, from_to(0, 0.5)));
  return check("sample_factor", sample_factor, from_to(0.1, 16));
}

namespace {

constexpr int limit_stride = 4;  // one ray of 16 looks ahead for its neighbours
constexpr float limit_margin = 1.03f;
constexpr float no_limit = std::numeric_limits<float>::max();

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
        out.at<float>(pixels[r] / width_, pixels[r] % width_) = end_of(block, r);
    });
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
    render(all, far, view);
    return view;
  }

  /// A quarter of the pixels, and of the rest, in two rounds, those whose neighbours aren't alike;
  /// these are their mean. So are the pixels that look ahead for the others: what they saw was
  /// sampled too thinly.
  RenderedView sparse_image(double alike) {
    RenderedView view = empty_view();
    cv::Mat far(height_, width_, CV_32FC1, cv::Scalar(no_limit)), ends = far.clone();
    const auto looks = [](int x, int y) { return x % limit_stride == 0 && y % limit_stride == 0; };
    const auto even = [](int x, int y) { return x % 2 == 0 && y % 2 == 0; };
    render(pixels_where(looks), far, view, &ends);
    far = limits_from(every_fourth(ends), far.size());
    render(pixels_where([&](int x, int y) {
             return !inside(x, y, 1) || (even(x, y) && (!looks(x, y) || !inside(x, y, 2)));
           }),
           far, view);
    const auto most = static_cast<float>(alike);
    const auto complete = [&](const Neighbours& neighbours, int margin, const auto& chosen) {
      std::vector<int> unlike;
      for (const int p :
           pixels_where([&](int x, int y) { return inside(x, y, margin) && chosen(x, y); }))
        if (!from_neighbours(view, p, neighbours, most)) unlike.push_back(p);
      render(unlike, far, view);
    };
    complete(beside_by_two, 2, looks);
    complete(diagonal, 1, [](int x, int y) { return x % 2 == 1 && y % 2 == 1; });
    complete(beside, 1, [](int x, int y) { return (x + y) % 2 == 1; });
    return view;
  }

 private:
  /// The listed pixels, each by its own ray; `ends`: as ends(), of these.
  void render(const std::vector<int>& wanted, const cv::Mat& far, RenderedView& view,
              cv::Mat* ends = nullptr) {
    const int channels = field_.channels();
    const auto at = [&](const cv::Mat& plane, int p) {
      return plane.at<float>(p / width_, p % width_);
    };
    parallel_blocks(static_cast<int>(wanted.size()), rays_per_block, [&](int begin, int end) {
      thread_local RayBlock block;
      thread_local std::vector<int> pixels, again;
      again.clear();
      for (const bool limited : {true, false}) {
        block.clear();
        pixels.clear();
        if (limited)
          for (int i = begin; i < end; ++i) {
            const int p = wanted[static_cast<std::size_t>(i)];
            add(p, at(far, p), pixels);
          }
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
          const float stop = end_of(block, r);
          if (ends != nullptr) ends->at<float>(y, x) = stop;
          if (limited && at(far, pixels[r]) < no_limit && stop == no_limit)
            again.push_back(pixels[r]);
        }
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

  using Neighbours = std::array<std::array<int, 2>, 4>;
  static constexpr Neighbours beside = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}},
                              diagonal = {{{-1, -1}, {1, -1}, {-1, 1}, {1, 1}}},
                              beside_by_two = {{{-2, 0}, {2, 0}, {0, -2}, {0, 2}}};

  /// The mean of the four neighbours, where nothing tells that there is more to be seen.
  bool from_neighbours(RenderedView& view, int pixel, const Neighbours& of, float alike) const {
    constexpr float alike_depth = 0.03F;  // of it; a step from one surface to another is more
    const int x = pixel % width_, y = pixel / width_;
    std::array<cv::Point, 4> around;
    for (std::size_t i = 0; i < 4; ++i) around[i] = {x + of[i][0], y + of[i][1]};
    const auto mean = [&](const cv::Mat& plane, int channels, int c, auto most, float& out) {
      float low = std::numeric_limits<float>::max(), high = -low, sum = 0;
      for (const cv::Point& p : around) {
        const float value = plane.ptr<float>(p.y)[p.x * channels + c];
        low = std::min(low, value);
        high = std::max(high, value);
        sum += value;
      }
      out = 0.25F * sum;
      return high - low <= most(high) && !std::isnan(sum);
    };
    const auto within = [alike](float) { return alike; };
    const int channels = field_.channels();
    std::array<float, 3> color{};
    for (int c = 0; c < channels; ++c)
      if (!mean(view.color, channels, c, within, color[static_cast<std::size_t>(c)])) return false;
    float opacity = 0, depth = nan;
    if (!mean(view.opacity, 1, 0, within, opacity)) return false;
    const auto is_sky = [&](const cv::Point& p) { return std::isnan(view.depth.at<float>(p)); };
    if (!std::all_of(around.begin(), around.end(), is_sky) &&
        !mean(
            view.depth, 1, 0, [](float z) { return alike_depth * z; }, depth))
      return false;
    std::copy_n(color.data(), channels, view.color.ptr<float>(y) + x * channels);
    view.opacity.at<float>(y, x) = opacity;
    view.depth.at<float>(y, x) = depth;
    return true;
  }

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
  /// Of ray r, as ends().
  float end_of(const RayBlock& block, std::size_t r) const {
    const auto last = static_cast<std::size_t>(block.first[r] + block.used[r] - 1);
    if (block.used[r] == 0 || !(block.light[last] < limits_.stop)) return no_limit;
    return block.t[last] + block.dt[last];
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
  if (options.alike > 0) return renderer.sparse_image(options.alike);
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
  RenderedView view =
      render_strided(state, ViewRays(camera, cam_from_world, state.space), 1, options);
  if (state.modality == Modality::thermal)
    view.color = view.color * (state.span.high - state.span.low) + state.span.low;
  return view;
}

}  // namespace orbitfuse::nerf
