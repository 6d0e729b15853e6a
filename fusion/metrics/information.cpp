// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "fusion/metrics/measures.hpp"

namespace orbitfuse::metrics {
namespace {

int bin(double v) { return std::clamp(static_cast<int>(std::floor(v + 0.5)), 0, 255); }

std::array<double, 256> histogram(const Plane& f) {
  std::array<double, 256> h{};
  for (int y = 0; y < f.rows; ++y)
    for (int x = 0; x < f.cols; ++x) h[static_cast<std::size_t>(bin(f(y, x)))] += 1;
  for (double& v : h) v /= static_cast<double>(f.total());
  return h;
}

}  // namespace

double entropy_bits(const Plane& f) {
  double sum = 0;
  for (double p : histogram(f)) {
    if (p > 0) sum -= p * std::log2(p);
  }
  return sum;
}

double mutual_information_nats(const Plane& a, const Plane& b) {
  std::vector<double> joint(256 * 256, 0.0);
  std::array<double, 256> pa{}, pb{};
  for (int y = 0; y < a.rows; ++y) {
    for (int x = 0; x < a.cols; ++x) {
      const auto i = static_cast<std::size_t>(bin(a(y, x))),
                 j = static_cast<std::size_t>(bin(b(y, x)));
      joint[256 * i + j] += 1;
      pa[i] += 1;
      pb[j] += 1;
    }
  }
  const double n = static_cast<double>(a.total());
  double sum = 0;
  for (std::size_t i = 0; i < 256; ++i) {
    for (std::size_t j = 0; j < 256; ++j) {
      const double p = joint[256 * i + j];
      if (p > 0) sum += p / n * std::log(p * n / (pa[i] * pb[j]));
    }
  }
  return sum;
}

double cross_entropy_bits(const Plane& source, const Plane& f) {
  const auto p = histogram(source), q = histogram(f);
  double sum = 0;
  for (std::size_t i = 0; i < 256; ++i) {
    if (p[i] > 0 && q[i] > 0) sum += p[i] * std::log2(p[i] / q[i]);
  }
  return sum;
}

double histogram_intersection(const Plane& a, const Plane& b) {
  const auto p = histogram(a), q = histogram(b);
  double sum = 0;
  for (std::size_t i = 0; i < 256; ++i) sum += std::min(p[i], q[i]);
  return sum;
}

}  // namespace orbitfuse::metrics
