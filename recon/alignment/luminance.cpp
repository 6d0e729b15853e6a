// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/luminance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/image/image_io.hpp"
#include "core/image/samples.hpp"
#include "core/numeric/median.hpp"

namespace orbitfuse {

Result<cv::Mat> read_luminance(const Session& session, const FrameRecord& frame) {
  const std::filesystem::path path = session.path_of(frame);
  cv::Mat values;
  if (frame.modality == Modality::thermal && !frame.thermal_is_gray) {
    ORBITFUSE_ASSIGN(values, read_thermal_k(path));
  } else {
    ORBITFUSE_ASSIGN(cv::Mat image,
                     frame.modality == Modality::visible ? read_visible(path) : read_image(path));
    if (image.channels() == 3) cv::cvtColor(image, image, cv::COLOR_BGR2GRAY);
    image.convertTo(values, CV_32F);
  }
  if (frame.width > 0 && (values.cols != frame.width || values.rows != frame.height))
    return fail(ErrorKind::input, path.string(),
                fmt::format("{}x{} px, the manifest says {}x{}", values.cols, values.rows,
                            frame.width, frame.height),
                "import the session again");
  return values;
}

namespace {

/// Standard deviation of the noise: how far pixels are from what their neighbours say of them, by a
/// mask that slopes and straight edges are nothing to (Immerkaer 1996), in the median.
double noise_of(const cv::Mat& values) {
  const cv::Matx33f mask(1, -2, 1, -2, 4, -2, 1, -2, 1);
  cv::Mat differences;
  cv::filter2D(values, differences, CV_32F, mask);
  std::vector<float> samples;
  append_finite(cv::abs(differences), samples);
  return sigma_of_median * median_in(samples) / cv::norm(mask);
}

/// A monotone curve through nodes; constant beyond them.
struct Curve {
  std::vector<float> at, value;

  float operator()(float v) const {
    const auto above = std::upper_bound(at.begin(), at.end(), v);
    if (above == at.begin()) return value.front();
    if (above == at.end()) return value.back();
    const auto i = static_cast<std::size_t>(above - at.begin());
    return value[i - 1] + (value[i] - value[i - 1]) * (v - at[i - 1]) / (at[i] - at[i - 1]);
  }
};

/// Ranks of the sorted samples at most `steps` apart, risen no steeper than `steepest`.
Curve rank_curve(const std::vector<float>& sorted, std::size_t steps, double steepest) {
  Curve curve{{sorted.front()}, {0}};
  std::size_t rank = 0;
  for (std::size_t i = 1; i <= steps; ++i) {
    const std::size_t next = i * (sorted.size() - 1) / steps;
    const float v = sorted[next];
    if (!(v > curve.at.back())) continue;  // equal values wait for the next larger one
    const double share = static_cast<double>(next - rank) / static_cast<double>(sorted.size());
    const double rise = std::min(share, steepest * static_cast<double>(v - curve.at.back()));
    curve.at.push_back(v);
    curve.value.push_back(curve.value.back() + static_cast<float>(rise));
    rank = next;
  }
  return curve;
}

/// Between values that differ at all: what rounding leaves undecided.
double smallest_step(const std::vector<float>& sorted) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < sorted.size(); ++i)
    if (sorted[i] > sorted[i - 1])
      least = std::min(least, static_cast<double>(sorted[i]) - static_cast<double>(sorted[i - 1]));
  return least;
}

}  // namespace

cv::Mat equalised(const cv::Mat& values) {
  constexpr std::size_t steps = 1024;
  constexpr double most_of_noise = 0.02;
  constexpr float straight = 0.3F;
  std::vector<float> samples;
  append_finite(values, samples);
  if (samples.empty()) return values.clone();
  std::sort(samples.begin(), samples.end());
  const double noise = std::max(noise_of(values), 0.3 * smallest_step(samples));
  const Curve by_rank = rank_curve(samples, steps, most_of_noise / noise);
  const float low = samples[samples.size() / 50],
              high = samples[samples.size() - 1 - samples.size() / 50];
  cv::Mat ranks = values.clone();
  for (float& v : cv::Mat_<float>(ranks)) {
    if (!std::isfinite(v)) continue;
    const float by_value = high > low ? (std::clamp(v, low, high) - low) / (high - low) : 0;
    v = (1 - straight) * by_rank(v) + straight * by_value;
  }
  return ranks;
}

}  // namespace orbitfuse
