// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "core/system/parallel.hpp"
#include "fusion/metrics/blur.hpp"
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

/// Sobel responses with zeros outside, in the signs of VIFB's code: they matter where gx == 0.
struct Edges {
  Plane strength, angle;
};

Edges edges_of(const Plane& f) {
  cv::Mat1d gx, gy;
  cv::Sobel(f, gx, CV_64F, 1, 0, 3, 1, 0, cv::BORDER_CONSTANT);
  cv::Sobel(f, gy, CV_64F, 0, 1, 3, 1, 0, cv::BORDER_CONSTANT);
  Edges e{Plane(f.size()), Plane(f.size())};
  parallel_blocks(f.rows, 16, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      for (int x = 0; x < f.cols; ++x) {
        const double dx = -gx(y, x), dy = gy(y, x);
        e.strength(y, x) = std::sqrt(dx * dx + dy * dy);
        e.angle(y, x) = dx == 0 ? std::numbers::pi / 2 : std::atan(dy / dx);
      }
    }
  });
  return e;
}

double preserved(double g, double a, double g_fused, double a_fused) {
  // VIFB's code puts the fused strength itself where both strengths are equal.
  const double strength = g > g_fused ? g_fused / g : g == g_fused ? g_fused : g / g_fused;
  const double direction = 1 - std::abs(a - a_fused) / (std::numbers::pi / 2);
  return 0.9994 / (1 + std::exp(-15 * (strength - 0.5))) *
         (0.9879 / (1 + std::exp(-22 * (direction - 0.8))));
}

}  // namespace

double structural_similarity(const Plane& a, const Plane& b) {
  constexpr double c1 = 6.5025, c2 = 58.5225;  // (0.01 * 255)^2, (0.03 * 255)^2
  const Plane ma = windowed(a), mb = windowed(b);
  const Plane aa = windowed(a.mul(a)), bb = windowed(b.mul(b)), ab = windowed(a.mul(b));
  double sum = 0;
  for (int y = 0; y < ma.rows; ++y) {
    double row = 0;
    for (int x = 0; x < ma.cols; ++x) {
      const double u = ma(y, x), v = mb(y, x), uv = u * v, uu_vv = u * u + v * v;
      row += (2 * uv + c1) * (2 * (ab(y, x) - uv) + c2) /
             ((uu_vv + c1) * (aa(y, x) + bb(y, x) - uu_vv + c2));
    }
    sum += row;
  }
  return sum / static_cast<double>(ma.total());
}

double edge_transfer(const Plane& visible, const Plane& thermal, const Plane& fused) {
  const Edges v = edges_of(visible), i = edges_of(thermal), f = edges_of(fused);
  std::vector<double> kept(static_cast<std::size_t>(fused.rows)), total(kept.size()),
      in_fused(kept.size());
  parallel_blocks(fused.rows, 16, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      double row_kept = 0, row_total = 0, row_fused = 0;
      for (int x = 0; x < fused.cols; ++x) {
        const double gv = v.strength(y, x), gi = i.strength(y, x), gf = f.strength(y, x),
                     af = f.angle(y, x);
        if (gv > 0) row_kept += gv * preserved(gv, v.angle(y, x), gf, af);
        if (gi > 0) row_kept += gi * preserved(gi, i.angle(y, x), gf, af);
        row_total += gv + gi;
        row_fused += gf;
      }
      const auto r = static_cast<std::size_t>(y);
      kept[r] = row_kept;
      total[r] = row_total;
      in_fused[r] = row_fused;
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
