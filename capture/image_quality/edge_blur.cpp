// SPDX-License-Identifier: BSD-3-Clause
#include "capture/image_quality/edge_blur.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <tuple>
#include <vector>

#include "capture/image_quality/image_noise.hpp"
#include "core/numeric/median.hpp"

namespace orbitfuse {
namespace {

constexpr std::array<double, 3> scales_px{1, 2, 4};  // slopes are taken through a Gaussian of this
constexpr int reach_px = 24, border_px = 3, directions = 4;
constexpr double tail = 0.15;            // of the peak, where an edge is taken to end
constexpr double within_tails = 0.9486;  // erf(sqrt(-ln tail)): of the contrast inside them
constexpr std::ptrdiff_t most = 400;     // edges looked at in a direction

/// Edges of a direction, to tell its width; small images have few.
std::size_t enough_in(const cv::Mat& image) {
  return static_cast<std::size_t>(std::clamp((image.rows + image.cols) / 10, 8, 24));
}

struct Signal {
  double noise;     ///< standard deviation, if it is white
  double range;     ///< between the levels that a fiftieth of the pixels is below and above
  double rounding;  ///< slopes that are arithmetic's alone
};

Signal signal_of(const cv::Mat& gray) {
  constexpr int stride = 3;
  std::vector<float> level;
  for (int y = 0; y < gray.rows; y += stride) {
    for (int x = 0; x < gray.cols; x += stride) level.push_back(gray.at<float>(y, x));
  }
  const double low = quantile(level, 0.02), high = quantile(level, 0.98);
  return {white_noise_sigma(gray, stride), high - low,
          1e-6 * std::max(std::abs(low), std::abs(high))};
}

float at(const cv::Mat& image, double x, double y) {
  const int left = static_cast<int>(x), top = static_cast<int>(y);
  const float u = static_cast<float>(x - left), v = static_cast<float>(y - top);
  const float *a = image.ptr<float>(top) + left, *b = image.ptr<float>(top + 1) + left;
  return (1 - v) * ((1 - u) * a[0] + u * a[1]) + v * ((1 - u) * b[0] + u * b[1]);
}

struct Fields {
  double scale_px = 0;
  cv::Mat smooth, dx, dy, slope;  ///< slope: the gradient's length
  /// Far above what noise reaches: it must not shift where an edge is steepest and where it ends.
  double least_slope = 0, least_contrast = 0;
};

Fields fields_of(const cv::Mat& gray, const Signal& signal, double scale_px) {
  Fields f;
  f.scale_px = scale_px;
  cv::GaussianBlur(gray, f.smooth, {}, scale_px, scale_px, cv::BORDER_REPLICATE);
  const cv::Matx13f derivative(-0.5F, 0, 0.5F);
  cv::filter2D(f.smooth, f.dx, CV_32F, derivative, {-1, -1}, 0, cv::BORDER_REPLICATE);
  cv::filter2D(f.smooth, f.dy, CV_32F, derivative.t(), {-1, -1}, 0, cv::BORDER_REPLICATE);
  cv::magnitude(f.dx, f.dy, f.slope);
  // White noise of 1 has 1 / (2 sqrt(pi) s) left after smoothing, its slope 1 / (sqrt(8 pi) s^2).
  f.least_slope =
      std::max(12 * signal.noise / (std::sqrt(8 * CV_PI) * scale_px * scale_px), signal.rounding);
  f.least_contrast =
      std::max(10 * signal.noise / (2 * std::sqrt(CV_PI) * scale_px), 0.05 * signal.range);
  return f;
}

struct Edge {
  int x, y;
  double peak, ux, uy;  ///< the slope and its direction
};

using EdgesByDirection = std::array<std::vector<Edge>, directions>;

/// Where the slope is steepest along its own direction; of each direction the strongest.
EdgesByDirection edges_of(const Fields& f) {
  EdgesByDirection edges;
  const auto row = static_cast<std::ptrdiff_t>(f.slope.step1());
  for (int y = border_px; y < f.slope.rows - border_px; ++y) {
    const float *slope = f.slope.ptr<float>(y), *dx = f.dx.ptr<float>(y), *dy = f.dy.ptr<float>(y);
    for (int x = border_px; x < f.slope.cols - border_px; ++x) {
      const float peak = slope[x];
      if (!(peak > static_cast<float>(f.least_slope))) continue;
      const float ux = dx[x] / peak, uy = dy[x] / peak;
      const auto right = std::lround(ux), down = std::lround(uy);
      const std::ptrdiff_t next = right + row * down;
      if (peak < slope[x + next] || peak <= slope[x - next]) continue;
      const int direction = down == 0 ? 0 : right == 0 ? 1 : right == down ? 2 : 3;
      edges[static_cast<std::size_t>(direction)].push_back({x, y, peak, ux, uy});
    }
  }
  for (std::vector<Edge>& list : edges) {
    if (std::ssize(list) <= most) continue;
    std::nth_element(list.begin(), list.begin() + most, list.end(),
                     [](const Edge& a, const Edge& b) {
                       return std::tie(b.peak, a.y, a.x) < std::tie(a.peak, b.y, b.x);
                     });
    list.resize(most);
  }
  return edges;
}

/// From the edge outwards (`sign`) until its slope has ended: how far the level has changed.
/// Nothing when it runs into a steeper edge.
std::optional<double> rise(const Fields& f, const Edge& e, int sign) {
  const double end = std::max(tail * e.peak, f.least_slope / 4);
  const double from = f.smooth.at<float>(e.y, e.x);
  double level = from;
  for (int step = 1; step <= reach_px; ++step) {
    const double x = e.x + sign * e.ux * step, y = e.y + sign * e.uy * step;
    if (!(x >= 1 && y >= 1 && x < f.slope.cols - 2 && y < f.slope.rows - 2)) break;
    const double slope = at(f.dx, x, y) * e.ux + at(f.dy, x, y) * e.uy;
    if (slope > 1.1 * e.peak) return std::nullopt;
    level = at(f.smooth, x, y);
    if (slope < end) break;
  }
  return sign * (level - from);
}

/// Sigma of the edge's own blur; nothing when it does not stand clear.
std::optional<double> width_of(const Fields& f, const Edge& e) {
  const auto before = rise(f, e, -1), after = rise(f, e, 1);
  if (!before || !after) return std::nullopt;
  const double contrast = (*before + *after) / within_tails;
  if (contrast < f.least_contrast) return std::nullopt;
  const double sigma = contrast / (std::sqrt(2 * CV_PI) * e.peak);
  return std::sqrt(std::max(0.0, sigma * sigma - f.scale_px * f.scale_px));
}

struct Width {
  double peak, sigma_px;
};

/// The median over the strongest third, at least `enough`, without those that are much
/// wider than its sharpest: these are shadows and shading, not edges.
double typical(std::vector<Width>& widths, std::size_t enough) {
  std::sort(widths.begin(), widths.end(),
            [](const Width& a, const Width& b) { return a.peak > b.peak; });
  widths.resize(std::max(enough, (widths.size() + 2) / 3));
  std::sort(widths.begin(), widths.end(),
            [](const Width& a, const Width& b) { return a.sigma_px < b.sigma_px; });
  const double limit = std::max(2.0, 3 * widths[widths.size() / 8].sigma_px);
  const auto end = std::find_if(widths.begin(), widths.end(),
                                [&](const Width& w) { return w.sigma_px > limit; });
  return widths[static_cast<std::size_t>(end - widths.begin()) / 2].sigma_px;
}

EdgeBlur blur_of(const Fields& f) {
  std::array<std::vector<Width>, directions> widths;
  std::size_t most_found = 0;
  const EdgesByDirection edges = edges_of(f);
  for (std::size_t d = 0; d < directions; ++d) {
    for (const Edge& edge : edges[d]) {
      if (const auto width = width_of(f, edge)) widths[d].push_back({edge.peak, *width});
    }
    most_found = std::max(most_found, widths[d].size());
  }
  const std::size_t enough = enough_in(f.slope);
  EdgeBlur blur;
  for (std::vector<Width>& list : widths) {
    // A direction in which little is seen tells little.
    if (list.size() < std::max(enough, most_found / 4)) continue;
    blur.edges += static_cast<int>(list.size());
    blur.sigma_px = std::max(blur.sigma_px, typical(list, enough));
  }
  return blur;
}

}  // namespace

EdgeBlur measure_edge_blur(const cv::Mat& gray) {
  CV_Assert(gray.type() == CV_32FC1);
  if (gray.rows < 16 || gray.cols < 16) return {};
  const Signal signal = signal_of(gray);
  for (const double scale_px : scales_px) {
    const EdgeBlur blur = blur_of(fields_of(gray, signal, scale_px));
    if (blur.edges > 0) return blur;
  }
  return {};
}

}  // namespace orbitfuse
