// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/proxy_images.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/image/image_io.hpp"
#include "core/image/palette.hpp"
#include "core/numeric/median.hpp"
#include "recon/alignment/luminance.hpp"

namespace orbitfuse {
namespace {

/// Median of each row's (or, transposed, column's) difference from its smoothed neighbourhood.
void remove_row_offsets(cv::Mat& image) {
  cv::Mat smooth;
  cv::blur(image, smooth, {1, 15});
  std::vector<float> difference(static_cast<std::size_t>(image.cols));
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x)
      difference[static_cast<std::size_t>(x)] = image.at<float>(y, x) - smooth.at<float>(y, x);
    image.row(y) -= median_in(difference);
  }
}

cv::Mat stretch(const cv::Mat& values, TemperatureSpan span) {
  cv::Mat filled = values.clone();
  filled.setTo(span.low_k, values != values);  // NaN
  cv::Mat gray;
  const double gain = 255.0 / std::max(span.high_k - span.low_k, 1e-9);
  filled.convertTo(gray, CV_8U, gain, -span.low_k * gain);
  return gray;
}

cv::Mat fit_to(const cv::Mat& image, int max_side) {
  const int side = std::max(image.cols, image.rows);
  if (side <= max_side) return image;
  const double scale = static_cast<double>(max_side) / side;
  cv::Mat small;
  cv::resize(image, small,
             {static_cast<int>(std::lround(image.cols * scale)),
              static_cast<int>(std::lround(image.rows * scale))},
             0, 0, cv::INTER_AREA);
  return small;
}

}  // namespace

cv::Mat without_stripes(const cv::Mat& image) {
  cv::Mat clean = image.clone();
  remove_row_offsets(clean);
  cv::Mat columns = clean.t();
  remove_row_offsets(columns);
  return columns.t();
}

Result<std::vector<ProxyImage>> write_proxies(const Session& session,
                                              const std::vector<const FrameRecord*>& frames,
                                              const ProxyOptions& options,
                                              const std::filesystem::path& folder,
                                              const Progress& progress) {
  std::vector<cv::Mat> images;
  for (const FrameRecord* frame : frames) {
    ORBITFUSE_TRY(progress.check("poses.proxies"));
    ORBITFUSE_ASSIGN(cv::Mat values, read_luminance(session, *frame));
    values = fit_to(values, options.max_side_px);
    if (options.destripe) values = without_stripes(values);
    images.push_back(std::move(values));
  }
  const bool thermal = !frames.empty() && frames.front()->modality == Modality::thermal;
  const TemperatureSpan session_span =
      thermal ? common_span(images, 1.0, 99.0) : TemperatureSpan{0.0, 255.0};

  std::vector<ProxyImage> proxies;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const TemperatureSpan span =
        thermal && options.per_image_stretch ? common_span({images[i]}, 1.0, 99.0) : session_span;
    cv::Mat gray = stretch(images[i], span);
    if (options.clahe) cv::createCLAHE(3.0, {8, 8})->apply(gray, gray);
    const std::string name = fmt::format("{:06}.png", i);
    ORBITFUSE_TRY(write_png(folder / name, gray));
    proxies.push_back({frames[i], name, gray.cols, gray.rows});
  }
  return proxies;
}

}  // namespace orbitfuse
