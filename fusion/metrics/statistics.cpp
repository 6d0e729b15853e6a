// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "fusion/metrics/measures.hpp"
#include "fusion/metrics/metrics.hpp"

namespace orbitfuse::metrics {

double mean(const Plane& f) {
  double sum = 0;
  for (int y = 0; y < f.rows; ++y) {
    double row = 0;  // row by row: the rounding error stays that of a short sum
    for (int x = 0; x < f.cols; ++x) row += f(y, x);
    sum += row;
  }
  return sum / static_cast<double>(f.total());
}

double standard_deviation(const Plane& f) {
  const double m = mean(f);
  double sum = 0;
  for (int y = 0; y < f.rows; ++y) {
    const double* p = f[y];
    double row = 0;
    for (int x = 0; x < f.cols; ++x) row += (p[x] - m) * (p[x] - m);
    sum += row;
  }
  return std::sqrt(sum / static_cast<double>(f.total()));
}

double spatial_frequency(const Plane& f) {
  double sum = 0;
  for (int y = 0; y < f.rows; ++y) {
    const double* p = f[y];
    const double* below = y + 1 < f.rows ? f[y + 1] : p;
    double row = 0;
    for (int x = 0; x < f.cols; ++x) row += (below[x] - p[x]) * (below[x] - p[x]);
    for (int x = 0; x + 1 < f.cols; ++x) row += (p[x + 1] - p[x]) * (p[x + 1] - p[x]);
    sum += row;
  }
  return std::sqrt(sum / static_cast<double>(f.total()));
}

double average_gradient(const Plane& f) {
  double sum = 0;
  for (int y = 0; y < f.rows; ++y) {
    const int above = std::max(0, y - 1), below = std::min(f.rows - 1, y + 1);
    const double step_y = 1.0 / std::max(1, below - above);
    const double *p = f[y], *a = f[above], *b = f[below];
    double row = 0;
    for (int x = 0; x < f.cols; ++x) {
      const int left = std::max(0, x - 1), right = std::min(f.cols - 1, x + 1);
      const double gx = (p[right] - p[left]) / std::max(1, right - left),
                   gy = (b[x] - a[x]) * step_y;
      row += std::sqrt((gx * gx + gy * gy) / 2);
    }
    sum += row;
  }
  return sum / ((f.rows - 1.0) * (f.cols - 1.0));
}

double edge_intensity(const Plane& f) {
  double sum = 0;
  for (int y = 0; y < f.rows; ++y) {
    const double *p = f[y], *a = f[std::max(0, y - 1)], *b = f[std::min(f.rows - 1, y + 1)];
    double row = 0;
    for (int x = 0; x < f.cols; ++x) {
      const int l = std::max(0, x - 1), r = std::min(f.cols - 1, x + 1);
      const double gx = (a[r] - a[l]) + 2 * (p[r] - p[l]) + (b[r] - b[l]);
      const double gy = (b[l] - a[l]) + 2 * (b[x] - a[x]) + (b[r] - a[r]);
      row += std::sqrt(gx * gx + gy * gy);
    }
    sum += row;
  }
  return sum / static_cast<double>(f.total());
}

double mean_squared_error(const Plane& a, const Plane& b) {
  double sum = 0;
  for (int y = 0; y < a.rows; ++y) {
    const double *p = a[y], *q = b[y];
    double row = 0;
    for (int x = 0; x < a.cols; ++x) row += (p[x] - q[x]) * (p[x] - q[x]);
    sum += row;
  }
  return sum / static_cast<double>(a.total());
}

double correlation(const Plane& a, const Plane& b) {
  const double ma = mean(a), mb = mean(b);
  double ab = 0, aa = 0, bb = 0;
  for (int y = 0; y < a.rows; ++y) {
    const double *p = a[y], *q = b[y];
    double row_ab = 0, row_aa = 0, row_bb = 0;
    for (int x = 0; x < a.cols; ++x) {
      row_ab += (p[x] - ma) * (q[x] - mb);
      row_aa += (p[x] - ma) * (p[x] - ma);
      row_bb += (q[x] - mb) * (q[x] - mb);
    }
    ab += row_ab;
    aa += row_aa;
    bb += row_bb;
  }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

double psnr_db(double mean_squared) {
  if (mean_squared <= 0) return identical_psnr_db;
  return std::min(identical_psnr_db, 10 * std::log10(255.0 * 255.0 / mean_squared));
}

}  // namespace orbitfuse::metrics
