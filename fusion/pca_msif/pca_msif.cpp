// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/pca_msif/pca_msif.hpp"

#include <array>
#include <cmath>

#include "core/system/parallel.hpp"

namespace orbitfuse::fusion {

cv::Vec2d pca_weights(const Plane& a, const Plane& b) {
  const cv::Vec2d equal(0.5, 0.5);
  const double mean_a = cv::mean(a)[0], mean_b = cv::mean(b)[0];
  double aa = 0, ab = 0, bb = 0;
  for (int y = 0; y < a.rows; ++y) {
    const float *p = a[y], *q = b[y];
    for (int x = 0; x < a.cols; ++x) {
      const double u = static_cast<double>(p[x]) - mean_a, v = static_cast<double>(q[x]) - mean_b;
      aa += u * u;
      ab += u * v;
      bb += v * v;
    }
  }
  // Rounding leaves a constant plane about 1e-7 of its level; that is no variance.
  const double floor = 1e-10 * static_cast<double>(a.total());
  if (!(aa + bb > floor)) return equal;
  // Eigenvector of the larger eigenvalue of [aa ab; ab bb].
  const double angle = 0.5 * std::atan2(2 * ab, aa - bb);
  double wa = std::cos(angle), wb = std::sin(angle);
  if (wa * wb < 0) wa = std::sqrt(aa), wb = std::sqrt(bb);
  return {std::abs(wa) / (std::abs(wa) + std::abs(wb)),
          std::abs(wb) / (std::abs(wa) + std::abs(wb))};
}

Result<Plane> fuse_pca_msif(const Plane& visible, const Plane& thermal,
                            const PcaMsifOptions& options, PcaMsifReport* report) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(check_pair(visible, thermal));
  PcaMsifReport own;
  PcaMsifReport& said = report ? *report : own;
  said = {};
  if (differing_share(visible, thermal, 0) == 0) {
    said.weights = {0.5, 0.5};
    said.skipped = true;
    return visible.clone();
  }
  const std::array<const Plane*, 2> sources = {&visible, &thermal};
  std::array<Plane, 2> base, detail;
  parallel_for(2, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    base[k] = smooth(*sources[k], options.smoother);
    detail[k] = *sources[k] - base[k];
  });
  said.weights = pca_weights(detail[0], detail[1]);
  Plane fused;
  cv::addWeighted(base[0], 0.5, base[1], 0.5, 0, fused);
  cv::scaleAdd(detail[0], said.weights[0], fused, fused);
  cv::scaleAdd(detail[1], said.weights[1], fused, fused);
  return fused;
}

}  // namespace orbitfuse::fusion
