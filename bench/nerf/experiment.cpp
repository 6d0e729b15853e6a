// SPDX-License-Identifier: BSD-3-Clause
#include "bench/nerf/experiment.hpp"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/image/image_io.hpp"
#include "core/system/clock.hpp"
#include "fusion/metrics/metrics.hpp"
#include "recon/nerf/training_views.hpp"

namespace orbitfuse::bench {
namespace {

struct Span {
  double low = 0, high = 1;
};

/// Visible: 0..1. Thermal: what the session's images hold.
Span span_of(const nerf::Dataset& data) {
  if (data.modality == Modality::visible) return {};
  Span span{1e9, -1e9};
  for (const auto& view : data.views) {
    double low, high;
    cv::minMaxLoc(view.image, &low, &high);
    span.low = std::min(span.low, low);
    span.high = std::max(span.high, high);
  }
  return span;
}

cv::Mat bytes_of(const cv::Mat& image, Span span) {
  const double scale = 255 / (span.high - span.low);
  cv::Mat bytes;
  image.convertTo(bytes, CV_8U, scale, -scale * span.low);
  return bytes;
}

/// Calls body(view, rendered) for each view that measures.
template <class Body>
Status each_test_view(const nerf::Field& field, const nerf::Dataset& data,
                      nerf::PhotoDetail* detail, const Body& body) {
  for (const auto& view : data.views) {
    if (!view.measure_only) continue;
    ORBITFUSE_ASSIGN(nerf::RenderedView out,
                     nerf::render(field, view.camera, view.cam_from_world, {}, {}));
    if (detail != nullptr)
      ORBITFUSE_TRY(detail->add(field, view.camera, view.cam_from_world, out, {}));
    ORBITFUSE_TRY(body(view, out));
  }
  return {};
}

}  // namespace

Result<nerf::PhotoDetail> detail_of(const nerf::Dataset& data, const nerf::DetailOptions& options) {
  std::vector<nerf::DetailSource> sources;
  for (const nerf::TrainingView& view : data.views)
    if (!view.measure_only)
      sources.push_back({{view.name, view.camera, view.cam_from_world},
                         [image = view.image]() -> Result<cv::Mat> { return image; }});
  return nerf::PhotoDetail::of(std::move(sources), options);
}

Result<TestError> test_error(const nerf::Field& field, const nerf::Dataset& data,
                             nerf::PhotoDetail* detail) {
  const Span span = span_of(data);
  TestError sum;
  ORBITFUSE_TRY(
      each_test_view(field, data, detail, [&](const auto& view, const auto& out) -> Status {
        const cv::Mat truth = view.image.reshape(1), found = out.color.reshape(1);
        double squared = 0, absolute = 0;
        long count = 0, scene = 0;
        for (int y = 0; y < truth.rows; ++y)
          for (int x = 0; x < truth.cols; ++x) {
            const double error = found.template at<float>(y, x) - truth.template at<float>(y, x);
            if (!std::isfinite(error)) continue;
            squared += error * error;
            ++count;
            if (truth.template at<float>(y, x) <= 273.15) continue;
            absolute += std::abs(error);
            ++scene;
          }
        const double width = span.high - span.low;
        sum.psnr_db += 10 * std::log10(width * width * static_cast<double>(count) / squared);
        sum.mae_k += absolute / static_cast<double>(std::max(1l, scene));
        ++sum.views;
        return {};
      }));
  sum.psnr_db /= sum.views;
  sum.mae_k /= sum.views;
  return sum;
}

Result<std::map<std::string, double>> table_metrics(const nerf::Field& field,
                                                    const nerf::Dataset& data,
                                                    nerf::PhotoDetail* detail) {
  const Span span = span_of(data);
  std::map<std::string, double> mean;
  int views = 0;
  ORBITFUSE_TRY(
      each_test_view(field, data, detail, [&](const auto& view, const auto& out) -> Status {
        ORBITFUSE_ASSIGN(const auto values,
                         render_metrics(bytes_of(view.image, span), bytes_of(out.color, span)));
        for (const MetricValue& value : values) mean[value.name] += value.value;
        ++views;
        return {};
      }));
  for (auto& [name, value] : mean) value /= views;
  return mean;
}

Status write_pictures(const nerf::Field& field, const nerf::Dataset& data,
                      const std::string& folder, nerf::PhotoDetail* detail) {
  const Span span = span_of(data);
  return each_test_view(field, data, detail, [&](const auto& view, const auto& out) -> Status {
    cv::Mat picture = bytes_of(out.color, span), depth;
    if (picture.channels() == 3) cv::cvtColor(picture, picture, cv::COLOR_RGB2BGR);
    ORBITFUSE_TRY(write_png(fmt::format("{}/{}.png", folder, view.name), picture));
    cv::Mat(1 / out.depth).convertTo(depth, CV_8U, 255 * 4);
    return write_png(fmt::format("{}/{}_depth.png", folder, view.name), depth);
  });
}

Result<double> add_depth(nerf::Dataset& data, const depth::DepthOptions& options) {
  Reconstruction model;
  std::vector<cv::Mat> images;
  std::vector<int> index;
  const nerf::ValueSpan span =
      nerf::estimate_span(nerf::training_part(data, nerf::left_out_views(data, 0)));
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    const nerf::TrainingView& view = data.views[i];
    if (view.measure_only) continue;
    images.push_back(
        bytes_of(view.image, {span.low, span.high}));  // R, G, B order: only its gray matters
    model.views.push_back({view.name, view.camera, view.cam_from_world});
    index.push_back(static_cast<int>(i));
  }
  const UsageClock clock;
  ORBITFUSE_ASSIGN(depth::DenseDepth found, depth::dense_depth(model, images, options, {}));
  const double cpu_s = clock.cpu_s();
  const depth::DepthReport& report = found.report;
  fmt::print("depth: {:.1f} CPU s, {:.1f} % of the pixels matched, {:.1f} % confirmed, ", cpu_s,
             100 * report.matched, 100 * report.known);
  fmt::print("{:.1f} % ground, {:.1f} % sky\n", 100 * report.open.ground, 100 * report.open.sky);
  for (DepthMap& map : found.maps) {
    map.view = index[static_cast<std::size_t>(map.view)];
    data.depth.push_back(std::move(map));
  }
  return cpu_s;
}

}  // namespace orbitfuse::bench
