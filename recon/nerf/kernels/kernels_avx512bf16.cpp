// SPDX-License-Identifier: BSD-3-Clause
#define ORBITFUSE_LANES 16
#include "recon/nerf/kernels/bf16_rounding.hpp"
#include "recon/nerf/kernels/kernels_impl.hpp"

// Layers with bf16 operands and fp32 sums (VDPBF16PS: two multiply-adds per lane). Grid and
// optimiser stay as in AVX-512.
namespace orbitfuse::nerf {
namespace {

constexpr int max_width = 256;

inline __m512bh pair_broadcast(const std::uint16_t* p) {
  std::int32_t bits;
  __builtin_memcpy(&bits, p, 4);
  return reinterpret_cast<__m512bh>(_mm512_set1_epi32(bits));
}

/// C[R][C*16] = sum over pairs of A (bf16 rows, `a_row` apart, pairs `a_pair` apart) and B
/// (bf16 [pairs][ldb][2]).
template <int R, int C, Epilogue E>
inline void tile_bf16(const std::uint16_t* a, long a_row, long a_pair, const std::uint16_t* b,
                      long ldb, float* c, long ldc, int pairs, const float* mask) {
  __m512 sum[R][C];
#pragma GCC unroll 16
  for (int r = 0; r < R; ++r)
#pragma GCC unroll 16
    for (int j = 0; j < C; ++j) sum[r][j] = _mm512_setzero_ps();
  for (int k = 0; k < pairs; ++k) {
    __m512bh row[C];
#pragma GCC unroll 16
    for (int j = 0; j < C; ++j)
      row[j] = reinterpret_cast<__m512bh>(_mm512_loadu_si512(b + 2 * (k * ldb + 16 * j)));
#pragma GCC unroll 16
    for (int r = 0; r < R; ++r) {
      const __m512bh x = pair_broadcast(a + r * a_row + k * a_pair);
#pragma GCC unroll 16
      for (int j = 0; j < C; ++j) sum[r][j] = _mm512_dpbf16_ps(sum[r][j], x, row[j]);
    }
  }
#pragma GCC unroll 16
  for (int r = 0; r < R; ++r)
#pragma GCC unroll 16
    for (int j = 0; j < C; ++j) {
      float* out = c + r * ldc + 16 * j;
      __m512 v = sum[r][j];
      if constexpr (E == Epilogue::relu) v = _mm512_max_ps(v, _mm512_setzero_ps());
      if constexpr (E == Epilogue::mask)
        v = _mm512_maskz_mov_ps(
            _mm512_cmp_ps_mask(_mm512_loadu_ps(mask + (out - c)), _mm512_setzero_ps(), _CMP_GT_OQ),
            v);
      if constexpr (E == Epilogue::add) v = _mm512_add_ps(v, _mm512_loadu_ps(out));
      _mm512_storeu_ps(out, v);
    }
}

/// Rows of fp32 input, converted tile by tile.
template <int R, int C, Epilogue E>
inline void rows_bf16(int rows, int depth, const float* in, const std::uint16_t* b, int columns,
                      float* out, const float* mask) {
  alignas(64) std::uint16_t a[R * max_width];
  int r = 0;
  for (; r + R <= rows; r += R) {
    Avx512Rounding::in_order(in + static_cast<long>(r) * depth, R * depth, a);
    const long at = static_cast<long>(r) * columns;
    tile_bf16<R, C, E>(a, depth, 2, b, columns, out + at, columns, depth / 2,
                       mask ? mask + at : nullptr);
  }
  for (; r < rows; ++r) {
    Avx512Rounding::in_order(in + static_cast<long>(r) * depth, depth, a);
    const long at = static_cast<long>(r) * columns;
    tile_bf16<1, C, E>(a, depth, 2, b, columns, out + at, columns, depth / 2,
                       mask ? mask + at : nullptr);
  }
}

template <Epilogue E>
inline void multiply_bf16(int rows, int columns, int depth, const float* in, const std::uint16_t* b,
                          float* out, const float* mask) {
  int n = 0;
  const auto at = [&](const float* p) { return p ? p + n : nullptr; };
  for (; n + 64 <= columns; n += 64)
    rows_bf16<6, 4, E>(rows, depth, in, b + 2 * n, columns, out + n, at(mask));
  for (; n + 32 <= columns; n += 32)
    rows_bf16<12, 2, E>(rows, depth, in, b + 2 * n, columns, out + n, at(mask));
  for (; n < columns; n += 16)
    rows_bf16<16, 1, E>(rows, depth, in, b + 2 * n, columns, out + n, at(mask));
}

void forward_bf16(const LayerView& layer, int rows, const float* in, float* out, bool relu) {
  if (relu)
    multiply_bf16<Epilogue::relu>(rows, layer.out, layer.in, in, layer.paired, out, nullptr);
  else
    multiply_bf16<Epilogue::store>(rows, layer.out, layer.in, in, layer.paired, out, nullptr);
}

void backward_input_bf16(const LayerView& layer, int rows, const float* dout, float* din,
                         const float* activation) {
  if (activation)
    multiply_bf16<Epilogue::mask>(rows, layer.in, layer.out, dout, layer.paired_t, din, activation);
  else
    multiply_bf16<Epilogue::store>(rows, layer.in, layer.out, dout, layer.paired_t, din, nullptr);
}

void backward_weights_bf16(const LayerView& layer, int rows, const float* in, const float* dout,
                           float* dweights) {
  constexpr int chunk = 128;
  alignas(64) std::uint16_t a[chunk * max_width], b[chunk * max_width];
  const int width = layer.in, columns = layer.out;
  for (int begin = 0; begin < rows; begin += chunk) {
    const int n = rows - begin < chunk ? rows - begin : chunk;
    Avx512Rounding::pair_rows(in + static_cast<long>(begin) * width, n, width, a);
    Avx512Rounding::pair_rows(dout + static_cast<long>(begin) * columns, n, columns, b);
    const int pairs = (n + 1) / 2;
    for (int j = 0; j < columns;) {
      const int left = columns - j;
      for (int i = 0; i < width; i += 4) {
        float* c = dweights + static_cast<long>(i) * columns + j;
        if (left >= 64)
          tile_bf16<4, 4, Epilogue::add>(a + 2 * i, 2, 2 * width, b + 2 * j, columns, c, columns,
                                         pairs, nullptr);
        else if (left >= 32)
          tile_bf16<4, 2, Epilogue::add>(a + 2 * i, 2, 2 * width, b + 2 * j, columns, c, columns,
                                         pairs, nullptr);
        else
          tile_bf16<4, 1, Epilogue::add>(a + 2 * i, 2, 2 * width, b + 2 * j, columns, c, columns,
                                         pairs, nullptr);
      }
      j += left >= 64 ? 64 : left >= 32 ? 32 : 16;
    }
  }
}

}  // namespace

const Kernels& kernels_avx512bf16() {
  static constexpr Kernels table{Isa::avx512bf16, encode_grid,         scatter_grid,
                                 forward_bf16,    backward_input_bf16, backward_weights_bf16,
                                 adam_update,     adam_lines};
  return table;
}

}  // namespace orbitfuse::nerf
