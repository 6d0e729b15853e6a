// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/best.hpp"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/parallel.hpp"
#include "fusion/pyramid/pyramid.hpp"

namespace orbitfuse::fusion {
namespace {

Plane local_energy(const Plane& band, int radius) {
  Plane energy;
  const int side = 2 * radius + 1;
  cv::GaussianBlur(band.mul(band), energy, {side, side}, 0, 0, cv::BORDER_REFLECT_101);
  return energy;
}

/// a^n / (a^n + b^n); 1/2 where both are nothing.
float share(float a, float b, float exponent) {
  constexpr float nothing = 1e-4F;  // gray levels squared; far below what a sensor resolves
  return 1 / (1 + std::pow((b + nothing) / (a + nothing), exponent));
}

Plane mixed(const Plane& v, const Plane& t, const Plane& activity_v, const Plane& activity_t, double sharpness) {
  const auto exponent = static_cast<float>(sharpness);
  Plane fused(v.size());
  parallel_blocks(v.rows, 32, [&](int begin, int end) {
    for (int y = begin; y < end; ++y)
      for (int x = 0; x < v.cols; ++x) {
        const float w = share(activity_v(y, x), activity_t(y, x), exponent);
        fused(y, x) = w * v(y, x) + (1 - w) * t(y, x);
      }
  });
  return fused;
}

/// Local variance over a square window.
Plane local_variance(const Plane& base, int side) {
  Plane mean, square;
  cv::boxFilter(base, mean, CV_32F, {side, side});
  cv::boxFilter(base.mul(base), square, CV_32F, {side, side});
  return cv::max(square - mean.mul(mean), 0.0F);
}

/// Each base pixel votes for the source that varies more round it; the votes are averaged widely,
/// so that a region takes its level from one source and the border between two regions is a ramp.
Plane fuse_base(const Plane& v, const Plane& t, const BestOptions& options) {
  const int side = std::min({options.base_window, v.rows, v.cols}), reach = std::min({options.base_vote, v.rows, v.cols});
  const Plane a = local_variance(v, side), b = local_variance(t, side);
  Plane vote(v.size());
  for (int y = 0; y < v.rows; ++y)
    for (int x = 0; x < v.cols; ++x) vote(y, x) = a(y, x) > b(y, x) ? 1.0F : a(y, x) < b(y, x) ? 0.0F : 0.5F;
  cv::boxFilter(vote, vote, CV_32F, {reach, reach});
  return t + vote.mul(v - t);
}

}  // namespace

Status BestOptions::validate() const {
  const auto bad = [](const char* field, double value, const char* rule) {
    return fail(ErrorKind::usage, std::string("best.") + field, fmt::format("{}", value), rule);
  };
  if (levels < 0 || levels > 12) return bad("levels", levels, "must be in 0..12");
  if (energy_radius_px < 0 || energy_radius_px > 15) return bad("energy_radius_px", energy_radius_px, "must be in 0..15");
  if (!(sharpness > 0 && sharpness <= 64)) return bad("sharpness", sharpness, "must be in (0, 64]");
  if (base_window < 1 || base_window > 255) return bad("base_window", base_window, "must be in 1..255");
  if (base_vote < 1 || base_vote > 255) return bad("base_vote", base_vote, "must be in 1..255");
  return {};
}

Result<Plane> fuse_best(const Plane& visible, const Plane& thermal, const BestOptions& options, BestReport* report) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(check_pair(visible, thermal));
  BestReport own;
  BestReport& said = report ? *report : own;
  said = {};
  if (differing_share(visible, thermal, 0) == 0) {
    said.skipped = true;
    return visible.clone();
  }
  const int levels = pyramid_levels(visible.size(), options.levels, 8);
  LaplacianPyramid v, t, fused;
  parallel_for(2, [&](int i) {
    (i == 0 ? v : t) = laplacian_pyramid(i == 0 ? visible : thermal, levels);
  });
  for (std::size_t i = 0; i < v.bands.size(); ++i)
    fused.bands.push_back(mixed(v.bands[i], t.bands[i], local_energy(v.bands[i], options.energy_radius_px),
                                local_energy(t.bands[i], options.energy_radius_px), options.sharpness / 2));
  fused.base = fuse_base(v.base, t.base, options);
  return collapse(fused);
}

}  // namespace orbitfuse::fusion
