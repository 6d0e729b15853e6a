// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "core/system/parallel.hpp"
#include "fusion/metrics/blur.hpp"
#include "fusion/metrics/lanes.hpp"
#include "fusion/metrics/measures.hpp"

namespace orbitfuse::metrics {
namespace {

/// The inner part of a Gaussian-filtered plane, where the 11x11 window lies wholly inside.
Plane windowed(const Plane& plane) {
  static const std::vector<double> half = [] {
    const auto raw = gaussian_half(1.5, 5, 1);
    return gaussian_half(1.5, 5, 1 / (2 * std::accumulate(raw.begin(), raw.end(), 0.0) - raw[0]));
  }();
  return Plane(blurred(plane, half)(cv::Rect(5, 5, plane.cols - 10, plane.rows - 10)));
}

/// Edge strength and direction that are kept, each through its sigmoid, of four pixels.
Lanes preserved(Lanes g, Lanes a, Lanes g_fused, Lanes a_fused) {
  // VIFB's code puts the fused strength itself where both strengths are equal.
  const Lanes larger = g > g_fused ? g : g_fused, smaller = g > g_fused ? g_fused : g;
  const Lanes strength = g == g_fused ? g_fused : smaller / larger;
  const Lanes apart = a > a_fused ? a - a_fused : a_fused - a;
  const Lanes direction = 1 - apart / (std::numbers::pi / 2);
  return 0.9994 * 0.9879 /
         ((1 + exp_of(-15 * (strength - 0.5))) * (1 + exp_of(-22 * (direction - 0.8))));
}

double similarity(const Plane& a, const WindowMoments& of_a, const Plane& b,
                  const WindowMoments& of_b) {
  constexpr double c1 = 6.5025, c2 = 58.5225;  // (0.01 * 255)^2, (0.03 * 255)^2
  const Plane product = windowed(a.mul(b));
  double sum = 0;
  for (int y = 0; y < product.rows; ++y) {
    double row = 0;
    for (int x = 0; x < product.cols; ++x) {
      const double u = of_a.mean(y, x), v = of_b.mean(y, x), uv = u * v, uu_vv = u * u + v * v;
      row += (2 * uv + c1) * (2 * (product(y, x) - uv) + c2) /
             ((uu_vv + c1) * (of_a.square(y, x) + of_b.square(y, x) - uu_vv + c2));
    }
    sum += row;
  }
  return sum / static_cast<double>(product.total());
}

}  // namespace

WindowMoments::WindowMoments(const Plane& plane)
    : mean(windowed(plane)), square(windowed(plane.mul(plane))) {}

double structural_similarity(const Plane& a, const Plane& b) {
  return similarity(a, WindowMoments(a), b, WindowMoments(b));
}

StructuralSimilarity::StructuralSimilarity(const Plane& visible, const Plane& thermal)
    : visible_(visible), thermal_(thermal), of_visible_(visible), of_thermal_(thermal) {}

SourceSimilarity StructuralSimilarity::of(const Plane& fused) const {
  const WindowMoments of_fused(fused);
  return {similarity(visible_, of_visible_, fused, of_fused),
          similarity(thermal_, of_thermal_, fused, of_fused)};
}

Edges::Edges(const Plane& plane) : strength(plane.size()), angle(plane.size()) {
  cv::Mat1d gx, gy;
  cv::Sobel(plane, gx, CV_64F, 1, 0, 3, 1, 0, cv::BORDER_CONSTANT);
  cv::Sobel(plane, gy, CV_64F, 0, 1, 3, 1, 0, cv::BORDER_CONSTANT);
  parallel_blocks(plane.rows, 16, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      // VIFB's signs: they matter where gx == 0.
      for_lanes(plane.cols, [&](int x, int count) {
        const Lanes dx = -load(gx[y] + x, count), dy = load(gy[y] + x, count);
        store(sqrt_of(dx * dx + dy * dy), strength[y] + x, count);
        const Lanes across = Lanes{} + std::numbers::pi / 2;
        store(dx == 0.0 ? across : atan_of(dy / dx), angle[y] + x, count);
      });
    }
  });
}

double EdgeTransfer::of(const Plane& fused) const {
  const Edges &v = visible_, &i = thermal_, f(fused);
  std::vector<double> kept(static_cast<std::size_t>(fused.rows)), total(kept.size()),
      in_fused(kept.size());
  parallel_blocks(fused.rows, 16, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      Lanes row_kept{}, row_total{}, row_fused{};
      for_lanes(fused.cols, [&](int x, int count) {
        const Lanes gf = load(f.strength[y] + x, count), af = load(f.angle[y] + x, count);
        for (const Edges* source : {&v, &i}) {
          const Lanes g = load(source->strength[y] + x, count),
                      a = load(source->angle[y] + x, count);
          row_kept += g > 0.0 ? g * preserved(g, a, gf, af) : Lanes{};
          row_total += g;
        }
        row_fused += gf;
      });
      const auto r = static_cast<std::size_t>(y);
      kept[r] = sum_of(row_kept);
      total[r] = sum_of(row_total);
      in_fused[r] = sum_of(row_fused);
    }
  });
  double sum = 0, weight = 0, edges = 0;
  for (std::size_t y = 0; y < kept.size(); ++y) {
    sum += kept[y];
    weight += total[y];
    edges += in_fused[y];
  }
  if (weight > 0) return sum / weight;
  return edges > 0 ? 0 : 1;
}

}  // namespace orbitfuse::metrics
