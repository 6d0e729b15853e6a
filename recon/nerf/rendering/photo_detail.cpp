// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/photo_detail.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/geometry/lens_fold.hpp"
#include "core/geometry/lifted.hpp"
#include "core/geometry/narrowed.hpp"
#include "core/image/undistorted.hpp"
#include "core/numeric/bilinear.hpp"
#include "core/numeric/median.hpp"
#include "core/option_range.hpp"
#include "core/system/parallel.hpp"
#include "core/system/trace.hpp"
#include "recon/nerf/field/field_state.hpp"
#include "recon/nerf/rendering/detail_confidence.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr float levels = 32767;  ///< a difference of the whole value range
/// Over which share of the width detail ends where no source sees on.
constexpr double feather = 0.005;
/// A view's twins, as bursts and brackets have them.
const double twin_cosine = std::cos(std::numbers::pi / 180);
/// Of prepared sources; the least recently asked go first.
constexpr std::size_t kept_bytes = std::size_t{1} << 30;

/// The four pixels round a place and their weights, apart because each pixel's confidence comes to
/// its own (blended() sums at once); none where the place isn't among pixels'
/// centres.
struct Corners {
  int x, y;
  std::array<float, 4> weight;  ///< (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)
};
std::optional<Corners> corners(const cv::Size& size, const Eigen::Vector2d& pixel) {
  const auto place = place_among<float>(size.width, size.height, pixel.x() - 0.5, pixel.y() - 0.5);
  if (!place) return std::nullopt;
  const float u = place->right, v = place->down;
  return Corners{place->x0, place->y0, {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v}};
}

template <class T>
float at(const cv::Mat& plane, const Corners& c, int channels = 1, int channel = 0) {
  const T* upper = plane.ptr<T>(c.y) + c.x * channels + channel;
  const T* lower = plane.ptr<T>(c.y + 1) + c.x * channels + channel;
  return c.weight[0] * static_cast<float>(upper[0]) +
         c.weight[1] * static_cast<float>(upper[channels]) +
         c.weight[2] * static_cast<float>(lower[0]) +
         c.weight[3] * static_cast<float>(lower[channels]);
}

/// The middle of what a view sees; none where it sees nothing.
std::optional<Eigen::Vector3d> looked_at(const Camera& camera, const Rigid3d& world_from_cam,
                                         const cv::Mat& depth) {
  constexpr int step = 8;
  std::vector<double> seen;
  for (int y = depth.rows / 4; y < depth.rows - depth.rows / 4; y += step)
    for (int x = depth.cols / 4; x < depth.cols - depth.cols / 4; x += step)
      if (const float z = depth.at<float>(y, x); std::isfinite(z)) seen.push_back(z);
  if (seen.empty()) return std::nullopt;
  return world_from_cam * (camera.ray_of({0.5 * camera.width, 0.5 * camera.height}) * median(seen));
}

Result<cv::Mat> image_of(const DetailSource& source) {
  ORBITFUSE_ASSIGN(cv::Mat image, source.image());
  ORBITFUSE_TRY(check_size(image, source.view.camera, source.view.name));
  return image;
}

}  // namespace

Status DetailOptions::validate() const {
  const OptionCheck check("detail");
  ORBITFUSE_TRY(check("sources", sources, from_to(0, 64)));
  ORBITFUSE_TRY(check("base_width_px", base_width_px, from_to(16, 8192)));
  ORBITFUSE_TRY(check("depth_tolerance", depth_tolerance, above_up_to(0, 0.5)));
  ORBITFUSE_TRY(check("field_weight", field_weight, from_to(0, 1)));
  ORBITFUSE_TRY(check("angle_deg", angle_deg, above_up_to(0, 180)));
  return check("unexplained", unexplained, above_up_to(0, 1));
}

Result<PhotoDetail> PhotoDetail::of(std::vector<DetailSource> sources, const DetailOptions& options,
                                    std::shared_ptr<KeptRenders> kept) {
  ORBITFUSE_TRY(options.validate());
  PhotoDetail detail;
  detail.kept_ = std::move(kept);
  detail.options_ = options;
  if (options.sources == 0) return detail;
  for (DetailSource& source : sources) detail.sources_.push_back({std::move(source), {}, {}, {}});
  return detail;
}

Camera PhotoDetail::base_of(const DetailSource& source) const {
  return narrowed_to(source.recorded, std::min(options_.base_width_px, source.view.camera.width));
}

/// Renders the field where the source stands, and keeps what the source shows beyond that.
Status PhotoDetail::prepare(const Field& field, const Progress& progress, Source& source) const {
  if (!source.depth.empty()) return {};
  const TraceSpan span("detail of a view");
  ORBITFUSE_ASSIGN(const cv::Mat image, image_of(source.recorded));
  ORBITFUSE_ASSIGN(const RenderedView base,
                   render_where_it_stands(field, source.recorded.view, base_of(source.recorded),
                                          kept_.get(), progress));
  cv::Mat shown;
  cv::resize(base.color, shown, image.size(), 0, 0, cv::INTER_CUBIC);
  const ValueSpan range = field.state().span;
  cv::Mat difference = (image - shown) * (1 / (range.high - range.low)), known;
  std::vector<cv::Mat> planes;
  cv::split(difference, planes);
  cv::Mat finite = planes[0] == planes[0];
  for (const cv::Mat& plane : planes) finite &= plane == plane;
  finite.convertTo(known, CV_32F, 1.0 / 255);
  cv::patchNaNs(difference, 0);
  source.confidence = confidence_of(difference, known, base.depth.size(), options_.unexplained);
  difference.convertTo(source.difference, CV_16S, levels);
  source.depth = base.depth;
  return {};
}

std::vector<std::string> PhotoDetail::names() const {
  std::vector<std::string> names;
  for (const Source& source : sources_) names.push_back(source.recorded.view.name);
  return names;
}

std::size_t PhotoDetail::Source::bytes() const {
  return difference.total() * difference.elemSize() + confidence.total() +
         depth.total() * sizeof(float);
}

void PhotoDetail::forget_old(const std::vector<Source*>& needed) {
  std::size_t bytes = 0;
  for (const Source& source : sources_) bytes += source.bytes();
  while (bytes > kept_bytes) {
    Source* oldest = nullptr;
    for (Source& source : sources_)
      if (!source.depth.empty() && std::find(needed.begin(), needed.end(), &source) == needed.end())
        if (oldest == nullptr || source.last_asked < oldest->last_asked) oldest = &source;
    if (oldest == nullptr) return;
    bytes -= oldest->bytes();
    oldest->difference.release(), oldest->confidence.release(), oldest->depth.release();
  }
}

std::vector<PhotoDetail::Source*> PhotoDetail::nearest(const Eigen::Vector3d& from,
                                                       const Eigen::Vector3d& looked_at,
                                                       const std::string& except) {
  const Eigen::Vector3d direction = (from - looked_at).normalized();
  std::vector<std::pair<double, Source*>> ranked;
  for (Source& source : sources_) {
    const Eigen::Vector3d other = camera_center(source.recorded.view.cam_from_world) - looked_at;
    const double cosine = other.normalized().dot(direction);
    const bool twin = !except.empty() && cosine > twin_cosine;
    if (source.recorded.view.name != except && !twin && cosine > 0)
      ranked.emplace_back(-cosine, &source);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Source*> chosen;
  for (const auto& [cosine, source] : ranked)
    if (chosen.size() < static_cast<std::size_t>(options_.sources)) chosen.push_back(source);
  return chosen;
}

/// A rendered view whose pixels ask the chosen sources.
class PhotoDetail::NewView {
 public:
  NewView(const Camera& camera, const Rigid3d& world_from_cam, const cv::Mat& depth,
          const std::vector<Source*>& sources, const DetailOptions& options)
      : camera_(camera), world_from_cam_(world_from_cam), depth_(depth), options_(options) {
    for (const Source* source : sources) {
      const PosedView& view = source->recorded.view;
      asked_.push_back(
          {*source, view.camera, view.cam_from_world, camera_center(view.cam_from_world),
           static_cast<double>(source->depth.cols) / view.camera.width,
           static_cast<double>(source->depth.rows) / view.camera.height, fold_of(view.camera)});
    }
  }

  /// The sources' mean, in value ranges, and 1 where there is one.
  void collect(cv::Mat& mean, cv::Mat& covered) const {
    const int channels = mean.channels();
    parallel_blocks(mean.rows, 8, [&](int begin, int end) {
      for (int y = begin; y < end; ++y)
        for (int x = 0; x < mean.cols; ++x) {
          float* values = mean.ptr<float>(y) + x * channels;
          const float weight = sum(x, y, channels, values);
          covered.at<float>(y, x) = weight > 0 ? 1.0F : 0.0F;
          const float all = weight + static_cast<float>(options_.field_weight);
          for (int c = 0; c < channels && weight > 0; ++c) values[c] /= all * levels;
        }
    });
  }

 private:
  struct Asked {
    const Source& source;
    Camera camera;
    Rigid3d cam_from_world;
    Eigen::Vector3d center;
    double base_x, base_y;  ///< base pixels a pixel
    double fold;            ///< fold_of()
  };

  float sum(int x, int y, int channels, float* values) const {
    const Eigen::Vector3d point = world_from_cam_ * lifted(depth_, camera_, x, y);
    if (!point.allFinite()) return 0;
    const Eigen::Vector3d ray = (point - world_from_cam_.translation).normalized();
    float total = 0;
    for (const Asked& asked : asked_) {
      const Eigen::Vector3d in_source = asked.cam_from_world * point;
      if (!(in_source.z() > 0) ||
          in_source.head<2>().squaredNorm() >= asked.fold * in_source.z() * in_source.z())
        continue;
      const Eigen::Vector2d pixel = asked.camera.project(in_source);
      const auto base =
          corners(asked.source.depth.size(), {pixel.x() * asked.base_x, pixel.y() * asked.base_y});
      if (!base) continue;
      // Not a number where one of the four has no depth.
      const double off = at<float>(asked.source.depth, *base) - in_source.z();
      if (!(std::abs(off) <= options_.depth_tolerance * in_source.z())) continue;
      auto full = corners(asked.source.difference.size(), pixel);
      if (!full) continue;
      const double cosine = ray.dot((point - asked.center).normalized());
      const double angle_deg = std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
      const auto near = static_cast<float>(std::exp(-angle_deg / options_.angle_deg) / 255);
      // A pixel that isn't believed must not come in by its neighbour's confidence.
      const cv::Mat& confidence = asked.source.confidence;
      for (std::size_t i = 0; i < 4; ++i) {
        const auto row = full->y + static_cast<int>(i / 2),
                   column = full->x + static_cast<int>(i % 2);
        full->weight[i] *= near * static_cast<float>(confidence.at<uchar>(row, column));
        total += full->weight[i];
      }
      for (int c = 0; c < channels; ++c)
        values[c] += at<std::int16_t>(asked.source.difference, *full, channels, c);
    }
    return total;
  }

  const Camera& camera_;
  const Rigid3d world_from_cam_;
  const cv::Mat& depth_;
  const DetailOptions& options_;
  std::vector<Asked> asked_;
};

Result<bool> PhotoDetail::prepare_one(const Field& field, const Camera& camera,
                                      const Rigid3d& cam_from_world, const cv::Mat& depth,
                                      const Progress& progress) {
  const Rigid3d world_from_cam = cam_from_world.inverse();
  const auto middle = looked_at(camera, world_from_cam, depth);
  if (!middle) return false;
  const std::vector<Source*> chosen = nearest(world_from_cam.translation, *middle, {});
  const auto missing = std::find_if(chosen.begin(), chosen.end(),
                                    [](const Source* source) { return source->depth.empty(); });
  if (missing == chosen.end()) return false;
  ORBITFUSE_TRY(prepare(field, progress, **missing));
  (*missing)->last_asked = ++asked_;
  forget_old(chosen);
  return true;
}

Result<double> PhotoDetail::add(const Field& field, const Camera& camera,
                                const Rigid3d& cam_from_world, RenderedView& seen,
                                const Progress& progress, const std::string& except) {
  const Rigid3d world_from_cam = cam_from_world.inverse();
  const auto middle = looked_at(camera, world_from_cam, seen.depth);
  if (!middle) return 0.0;
  const std::vector<Source*> chosen = nearest(world_from_cam.translation, *middle, except);
  if (chosen.empty()) return 0.0;
  ++asked_;
  for (Source* source : chosen) {
    ORBITFUSE_TRY(progress.check("render"));
    ORBITFUSE_TRY(prepare(field, progress, *source));
    source->last_asked = asked_;
  }
  forget_old(chosen);

  const TraceSpan span("detail of a new view");
  cv::Mat mean = cv::Mat::zeros(seen.color.size(), seen.color.type());
  cv::Mat covered(mean.size(), CV_32F);
  NewView(camera, world_from_cam, seen.depth, chosen, options_).collect(mean, covered);
  const double share = cv::mean(covered)[0];
  cv::Mat strength = blurred(covered, feather * mean.cols);
  strength = strength.mul(strength).mul(seen.opacity);
  const ValueSpan range = field.state().span;
  const auto width = static_cast<float>(range.high - range.low);
  const int channels = mean.channels();
  const bool bounded = channels == 3;  // colours end at black and white
  parallel_blocks(mean.rows, 8, [&](int begin, int end) {
    for (int y = begin; y < end; ++y)
      for (int i = 0; i < mean.cols * channels; ++i) {
        float& value = seen.color.ptr<float>(y)[i];
        value += width * strength.ptr<float>(y)[i / channels] * mean.ptr<float>(y)[i];
        if (bounded) value = std::clamp(value, 0.0F, 1.0F);
      }
  });
  return share;
}

Result<DetailTrial> PhotoDetail::try_on(const Field& field, const std::vector<std::string>& names,
                                        const Progress& progress) {
  DetailTrial trial;
  double without = 0, with = 0, count = 0;
  for (const Source& source : sources_) {
    const PosedView& view = source.recorded.view;
    if (std::find(names.begin(), names.end(), view.name) == names.end()) continue;
    ORBITFUSE_ASSIGN(cv::Mat recorded, image_of(source.recorded));
    // Finer than the base: what only the sources show is tried too.
    const Camera base = base_of(source.recorded);
    Camera camera = view.camera.width > 2 * base.width
                        ? base.scaled_to(2 * base.width, 2 * base.height)
                        : view.camera;
    if (recorded.cols != camera.width)
      cv::resize(recorded, recorded, {camera.width, camera.height}, 0, 0, cv::INTER_AREA);
    const int above = camera.height / 4;
    camera.height -= 2 * above, camera.cy -= above;
    recorded = recorded.rowRange(above, above + camera.height);
    ORBITFUSE_ASSIGN(RenderedView seen, render(field, camera, view.cam_from_world, {}, progress));
    const cv::Mat before = seen.color.clone();
    ORBITFUSE_TRY(add(field, camera, view.cam_from_world, seen, progress, view.name));
    for (int y = 0; y < recorded.rows; ++y)
      for (int i = 0; i < recorded.cols * recorded.channels(); ++i) {
        const float truth = recorded.ptr<float>(y)[i];
        const float alone = std::abs(before.ptr<float>(y)[i] - truth),
                    both = std::abs(seen.color.ptr<float>(y)[i] - truth);
        if (!std::isfinite(alone) || !std::isfinite(both)) continue;  // outside of a bent lens
        without += alone;
        with += both;
        ++count;
      }
    ++trial.views;
  }
  if (count == 0) return DetailTrial{};
  const ValueSpan range = field.state().span;
  trial.without = without / count / (range.high - range.low);
  trial.with = with / count / (range.high - range.low);
  return trial;
}

}  // namespace orbitfuse::nerf
