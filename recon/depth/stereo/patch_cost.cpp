// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/stereo/patch_cost.hpp"

#include <immintrin.h>

#include <algorithm>
#include <cmath>

namespace orbitfuse::depth {
namespace {

struct Offsets {
  alignas(32) float x[patch_samples]{}, y[patch_samples]{}, closeness[patch_samples]{};
  Offsets() {
    int i = 0;
    for (int dy = -3; dy <= 3; ++dy)
      for (int dx = -4; dx <= 4; ++dx) {
        if ((dx + dy) % 2 == 0 && i < patch_samples) {
          x[i] = static_cast<float>(dx);
          y[i] = static_cast<float>(dy);
          closeness[i++] = std::exp(-static_cast<float>(dx * dx + dy * dy) / (2 * 9.0f));
        }
      }
  }
};

const Offsets& offsets() {
  static const Offsets all;
  return all;
}

constexpr float brightness_sigma = 30.0f;  // of 255
constexpr float min_variance = 4.0f;       // gray levels squared: below this a patch says nothing

Eigen::Matrix3f intrinsics(const Camera& c) {
  Eigen::Matrix3f k = Eigen::Matrix3f::Identity();
  k(0, 0) = static_cast<float>(c.fx);
  k(1, 1) = static_cast<float>(c.fy);
  k(0, 2) = static_cast<float>(c.cx);
  k(1, 2) = static_cast<float>(c.cy);
  return k;
}

Eigen::Matrix3f inverse_intrinsics(const Camera& c) {
  Eigen::Matrix3f k = Eigen::Matrix3f::Identity();
  k(0, 0) = static_cast<float>(1 / c.fx);
  k(1, 1) = static_cast<float>(1 / c.fy);
  k(0, 2) = static_cast<float>(-c.cx / c.fx);
  k(1, 2) = static_cast<float>(-c.cy / c.fy);
  return k;
}

float sum(__m256 v) {
  const __m128 half = _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
  const __m128 quarter = _mm_add_ps(half, _mm_movehl_ps(half, half));
  return _mm_cvtss_f32(_mm_add_ss(quarter, _mm_movehdup_ps(quarter)));
}

}  // namespace

SourceView source_view(const DepthView& reference, const DepthView& source) {
  SourceView out;
  out.pixels = source.gray.ptr<std::uint8_t>();
  out.width = source.gray.cols;
  out.height = source.gray.rows;
  out.stride = static_cast<int>(source.gray.step[0]);
  const Eigen::Matrix3f rotation = source.world_rotation * reference.world_rotation.transpose();
  const Eigen::Vector3f t = source.translation - rotation * reference.translation;
  out.a = intrinsics(source.camera) * rotation * inverse_intrinsics(reference.camera);
  out.b = intrinsics(source.camera) * t;
  return out;
}

ReferencePatch reference_patch(const DepthView& view, int x, int y) {
  const Offsets& o = offsets();
  ReferencePatch patch;
  patch.x = static_cast<float>(x) + 0.5f;
  patch.y = static_cast<float>(y) + 0.5f;
  const float center = view.gray.at<std::uint8_t>(y, x);
  float total = 0, mean = 0;
  for (int i = 0; i < patch_samples; ++i) {
    const int px = x + static_cast<int>(o.x[i]), py = y + static_cast<int>(o.y[i]);
    const bool inside = px >= 0 && py >= 0 && px < view.gray.cols && py < view.gray.rows;
    const float v = inside ? static_cast<float>(view.gray.at<std::uint8_t>(py, px)) : 0.0f;
    const float d = (v - center) / brightness_sigma;
    patch.weight[i] = inside ? o.closeness[i] / (1.0f + d * d) : 0.0f;
    patch.value[i] = v;
    total += patch.weight[i];
    mean += patch.weight[i] * v;
  }
  mean /= total;
  for (int i = 0; i < patch_samples; ++i) {
    patch.weight[i] /= total;
    const float d = patch.value[i] - mean;
    patch.value[i] = patch.weight[i] * d;
    patch.variance += patch.value[i] * d;
  }
  return patch;
}

bool is_flat(const ReferencePatch& patch) { return patch.variance < min_variance; }

float patch_cost(const ReferencePatch& patch, const SourceView& s, const Eigen::Vector3f& plane) {
  if (is_flat(patch)) return 1.0f;
  // x_s ~ a x + b (plane . x): the homography acts on (x, y, 1).
  const Eigen::Matrix3f h = s.a + s.b * plane.transpose();
  const Eigen::Vector3f at = h * Eigen::Vector3f(patch.x, patch.y, 1.0f);
  if (!(at.z() > 1e-6f)) return worst_cost;
  const float cx = at.x() / at.z(), cy = at.y() / at.z();
  if (!(cx >= 0 && cy >= 0 && cx < static_cast<float>(s.width) &&
        cy < static_cast<float>(s.height)))
    return worst_cost;

  const Offsets& o = offsets();
  const __m256 max_x = _mm256_set1_ps(static_cast<float>(s.width) - 1.001f);
  const __m256 max_y = _mm256_set1_ps(static_cast<float>(s.height) - 1.001f);
  const __m256 zero = _mm256_setzero_ps(), half = _mm256_set1_ps(0.5f), one = _mm256_set1_ps(1.0f);
  const __m256i byte = _mm256_set1_epi32(255), stride = _mm256_set1_epi32(s.stride);
  __m256 mean = zero, square = zero, cross = zero, inside_weight = zero;
  const auto row = [&](int r, __m256 dx, __m256 dy) {
    return _mm256_fmadd_ps(_mm256_set1_ps(h(r, 0)), dx,
                           _mm256_fmadd_ps(_mm256_set1_ps(h(r, 1)), dy, _mm256_set1_ps(at(r))));
  };
  for (int i = 0; i < patch_samples; i += 8) {
    const __m256 dx = _mm256_load_ps(o.x + i), dy = _mm256_load_ps(o.y + i);
    const __m256 w = row(2, dx, dy);
    const __m256 inverse = _mm256_div_ps(one, w);
    const __m256 u = _mm256_sub_ps(_mm256_mul_ps(row(0, dx, dy), inverse), half);
    const __m256 v = _mm256_sub_ps(_mm256_mul_ps(row(1, dx, dy), inverse), half);
    // NaN (w = 0) clamps to 0 because max returns its second operand.
    const __m256 uc = _mm256_min_ps(_mm256_max_ps(u, zero), max_x);
    const __m256 vc = _mm256_min_ps(_mm256_max_ps(v, zero), max_y);
    const __m256i iu = _mm256_cvttps_epi32(uc), iv = _mm256_cvttps_epi32(vc);
    const __m256 fu = _mm256_sub_ps(uc, _mm256_cvtepi32_ps(iu));
    const __m256 fv = _mm256_sub_ps(vc, _mm256_cvtepi32_ps(iv));
    const __m256i index = _mm256_add_epi32(_mm256_mullo_epi32(iv, stride), iu);
    const __m256i top = _mm256_i32gather_epi32(reinterpret_cast<const int*>(s.pixels), index, 1);
    const __m256i low =
        _mm256_i32gather_epi32(reinterpret_cast<const int*>(s.pixels + s.stride), index, 1);
    const auto mix = [&](__m256i four) {
      const __m256 p = _mm256_cvtepi32_ps(_mm256_and_si256(four, byte));
      const __m256 q = _mm256_cvtepi32_ps(_mm256_and_si256(_mm256_srli_epi32(four, 8), byte));
      return _mm256_fmadd_ps(fu, _mm256_sub_ps(q, p), p);
    };
    const __m256 above = mix(top), below = mix(low);
    const __m256 value = _mm256_fmadd_ps(fv, _mm256_sub_ps(below, above), above);
    const __m256 ahead = _mm256_cmp_ps(w, zero, _CMP_GT_OQ);
    const __m256 inside = _mm256_and_ps(
        ahead, _mm256_and_ps(_mm256_cmp_ps(u, uc, _CMP_EQ_OQ), _mm256_cmp_ps(v, vc, _CMP_EQ_OQ)));
    const __m256 weight = _mm256_load_ps(patch.weight + i);
    inside_weight = _mm256_add_ps(inside_weight, _mm256_and_ps(inside, weight));
    const __m256 weighted = _mm256_mul_ps(weight, value);
    mean = _mm256_add_ps(mean, weighted);
    square = _mm256_fmadd_ps(weighted, value, square);
    cross = _mm256_fmadd_ps(_mm256_load_ps(patch.value + i), value, cross);
  }
  if (sum(inside_weight) < 0.6f) return worst_cost;
  const float m = sum(mean);
  const float variance = sum(square) - m * m;
  if (variance < min_variance) return 1.0f;
  return std::clamp(1.0f - sum(cross) / std::sqrt(patch.variance * variance), 0.0f, worst_cost);
}

}  // namespace orbitfuse::depth
