// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Part of kernels_impl.hpp, whose rules hold here.
#include <immintrin.h>

#include "recon/nerf/kernels/kernels.hpp"

namespace orbitfuse::nerf {
namespace {

struct AdamState {
  __m256 value, first, second;
};

/// Numbers whose gradient is exactly 0 keep their state.
template <bool within_half>
inline AdamState adam_step(const AdamStep& step, const AdamState& old, __m256 raw) {
  const __m256 largest = _mm256_set1_ps(1e15f), minus_largest = _mm256_set1_ps(-1e15f);
  const __m256 limit = _mm256_set1_ps(max_half), minus_limit = _mm256_set1_ps(-max_half);
  const __m256 used = _mm256_cmp_ps(raw, _mm256_setzero_ps(), _CMP_NEQ_UQ);
  // Its square must stay finite; the order of the operands turns NaN into the bound.
  const __m256 bounded = _mm256_max_ps(_mm256_min_ps(raw, largest), minus_largest);
  const __m256 g = _mm256_fmadd_ps(_mm256_set1_ps(step.weight_decay), old.value, bounded);
  const __m256 m =
      _mm256_fmadd_ps(_mm256_set1_ps(1 - step.beta1), _mm256_sub_ps(g, old.first), old.first);
  const __m256 v = _mm256_fmadd_ps(_mm256_set1_ps(1 - step.beta2),
                                   _mm256_sub_ps(_mm256_mul_ps(g, g), old.second), old.second);
  const __m256 root = _mm256_sqrt_ps(_mm256_mul_ps(v, _mm256_set1_ps(step.correction2)));
  const __m256 change =
      _mm256_div_ps(_mm256_mul_ps(m, _mm256_set1_ps(step.learning_rate * step.correction1)),
                    _mm256_add_ps(root, _mm256_set1_ps(step.epsilon)));
  __m256 next = _mm256_sub_ps(old.value, change);
  if (within_half) next = _mm256_max_ps(minus_limit, _mm256_min_ps(limit, next));
  return {_mm256_blendv_ps(old.value, next, used), _mm256_blendv_ps(old.first, m, used),
          _mm256_blendv_ps(old.second, v, used)};
}

inline void adam_update(const AdamStep& step, std::int64_t count, float* parameter, float* first,
                        float* second, float* grad) {
  for (std::int64_t i = 0; i < count; i += 8) {
    const AdamState old{_mm256_loadu_ps(parameter + i), _mm256_loadu_ps(first + i),
                        _mm256_loadu_ps(second + i)};
    const AdamState next = adam_step<false>(step, old, _mm256_loadu_ps(grad + i));
    _mm256_storeu_ps(parameter + i, next.value);
    _mm256_storeu_ps(first + i, next.first);
    _mm256_storeu_ps(second + i, next.second);
    _mm256_storeu_ps(grad + i, _mm256_setzero_ps());
  }
}

/// Lines of a few words of the bitmap, on their way from memory.
struct TouchedLines {
  static constexpr int words = 4;
  std::uint32_t line[64 * words];
  int count;

  /// Takes the bits of up to `words` words from `begin` on.
  void take(std::int64_t begin, std::int64_t end, std::uint64_t* touched, const GridLine* lines,
            const std::uint16_t* half) {
    count = 0;
    for (std::int64_t w = begin; w < begin + words && w < end; ++w) {
      std::uint64_t bits = touched[w];
      touched[w] = 0;
      for (; bits != 0; bits &= bits - 1) {
        const std::int64_t at = 64 * w + __builtin_ctzll(bits);
        _mm_prefetch(reinterpret_cast<const char*>(lines + at), _MM_HINT_T0);
        _mm_prefetch(reinterpret_cast<const char*>(half + 4 * at), _MM_HINT_T0);
        line[count++] = static_cast<std::uint32_t>(at);
      }
    }
  }
};

inline __m256 load_two(const float* low, const float* high) {
  return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(low)), _mm_load_ps(high), 1);
}

inline void store_two(float* low, float* high, __m256 v) {
  _mm_store_ps(low, _mm256_castps256_ps128(v));
  _mm_store_ps(high, _mm256_extractf128_ps(v, 1));
}

inline void adam_lines(const AdamStep& step, std::int64_t words, std::uint64_t* touched,
                       GridLine* lines, std::uint16_t* half) {
  // Beside the last line of an odd number: no gradient, so nothing moves.
  GridLine no_line;
  std::uint16_t no_half[4];
  TouchedLines batches[2];
  int turn = 0;
  batches[0].take(0, words, touched, lines, half);
  for (std::int64_t w = 0; w < words; w += TouchedLines::words, turn ^= 1) {
    batches[turn ^ 1].take(w + TouchedLines::words, words, touched, lines, half);
    const TouchedLines& batch = batches[turn];
    for (int k = 0; k < batch.count; k += 2) {
      const bool two = k + 1 < batch.count;
      const std::uint32_t line_a = batch.line[k], line_b = two ? batch.line[k + 1] : 0;
      GridLine& a = lines[line_a];
      GridLine& b = two ? lines[line_b] : no_line;
      const AdamState old{load_two(a.value, b.value), load_two(a.first, b.first),
                          load_two(a.second, b.second)};
      const AdamState next = adam_step<true>(step, old, load_two(a.grad, b.grad));
      store_two(a.value, b.value, next.value);
      store_two(a.first, b.first, next.first);
      store_two(a.second, b.second, next.second);
      store_two(a.grad, b.grad, _mm256_setzero_ps());
      const __m128i copy = _mm256_cvtps_ph(next.value, _MM_FROUND_TO_NEAREST_INT);
      _mm_storel_pi(reinterpret_cast<__m64*>(half + 4l * line_a), _mm_castsi128_ps(copy));
      _mm_storeh_pi(reinterpret_cast<__m64*>(two ? half + 4l * line_b : no_half),
                    _mm_castsi128_ps(copy));
    }
  }
}

}  // namespace
}  // namespace orbitfuse::nerf
