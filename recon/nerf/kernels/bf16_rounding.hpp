// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// fp32 to bf16 with AVX-512 BF16, in the layouts that matrix kernels read. Only for sources
// compiled for it; no standard-library templates in here (see kernels_impl.hpp).
#include <immintrin.h>

#include <cstdint>

namespace orbitfuse::nerf {
namespace {

/// Widths are multiples of 16. Rounds to nearest even; denormals become 0.
struct Avx512Rounding {
  /// `count` floats in their order.
  static inline void in_order(const float* in, int count, std::uint16_t* out) {
    for (int i = 0; i < count; i += 16)
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + i),
                          reinterpret_cast<__m256i>(_mm512_cvtneps_pbh(_mm512_loadu_ps(in + i))));
  }

  /// [rows/2][width][2]: neighbouring samples become the pairs that are summed over.
  static inline void pair_rows(const float* in, int rows, int width, std::uint16_t* out) {
    for (int s = 0; s < rows; s += 2)
      for (int i = 0; i < width; i += 16)
        _mm512_storeu_si512(out + static_cast<long>(s) * width + 2 * i,
                            pairs(in + static_cast<long>(s) * width + i, rows - s, width));
  }

  /// [width][stride], of which [0, rows) of every row is written, and zeros up to a multiple of 32.
  static inline void transpose(const float* in, int rows, int width, long stride,
                               std::uint16_t* out) {
    for (int s = 0; s < rows; s += 32)
      for (int i = 0; i < width; i += 16) {
        __m512i block[16];  // [pair of samples][feature]
#pragma GCC unroll 16
        for (int p = 0; p < 16; ++p)
          block[p] = pairs(in + static_cast<long>(s + 2 * p) * width + i, rows - s - 2 * p, width);
        transpose_block(block);
#pragma GCC unroll 16
        for (int k = 0; k < 16; ++k) _mm512_storeu_si512(out + (i + k) * stride + s, block[k]);
      }
  }

 private:
  /// 16 features of two samples; of the `left` samples from `in` on, those that are missing are 0.
  static inline __m512i pairs(const float* in, int left, int width) {
    const __m512i low_high =
        _mm512_set_epi16(31, 15, 30, 14, 29, 13, 28, 12, 27, 11, 26, 10, 25, 9, 24, 8, 23, 7, 22, 6,
                         21, 5, 20, 4, 19, 3, 18, 2, 17, 1, 16, 0);
    const __m512 even = left > 0 ? _mm512_loadu_ps(in) : _mm512_setzero_ps();
    const __m512 odd = left > 1 ? _mm512_loadu_ps(in + width) : _mm512_setzero_ps();
    return _mm512_permutexvar_epi16(low_high,
                                    reinterpret_cast<__m512i>(_mm512_cvtne2ps_pbh(odd, even)));
  }

  /// 16 x 16 words of 32 bits: within lanes of 4, then lanes.
  static inline void transpose_block(__m512i (&r)[16]) {
    __m512i u[16];
#pragma GCC unroll 4
    for (int g = 0; g < 16; g += 4) {
      const __m512i a = _mm512_unpacklo_epi32(r[g], r[g + 1]);
      const __m512i b = _mm512_unpackhi_epi32(r[g], r[g + 1]);
      const __m512i c = _mm512_unpacklo_epi32(r[g + 2], r[g + 3]);
      const __m512i d = _mm512_unpackhi_epi32(r[g + 2], r[g + 3]);
      u[g] = _mm512_unpacklo_epi64(a, c);
      u[g + 1] = _mm512_unpackhi_epi64(a, c);
      u[g + 2] = _mm512_unpacklo_epi64(b, d);
      u[g + 3] = _mm512_unpackhi_epi64(b, d);
    }
#pragma GCC unroll 4
    for (int c = 0; c < 4; ++c) {
      const __m512i even_top = _mm512_shuffle_i32x4(u[c], u[4 + c], 0x88);
      const __m512i odd_top = _mm512_shuffle_i32x4(u[c], u[4 + c], 0xdd);
      const __m512i even_low = _mm512_shuffle_i32x4(u[8 + c], u[12 + c], 0x88);
      const __m512i odd_low = _mm512_shuffle_i32x4(u[8 + c], u[12 + c], 0xdd);
      r[c] = _mm512_shuffle_i32x4(even_top, even_low, 0x88);
      r[4 + c] = _mm512_shuffle_i32x4(odd_top, odd_low, 0x88);
      r[8 + c] = _mm512_shuffle_i32x4(even_top, even_low, 0xdd);
      r[12 + c] = _mm512_shuffle_i32x4(odd_top, odd_low, 0xdd);
    }
  }
};

}  // namespace
}  // namespace orbitfuse::nerf
