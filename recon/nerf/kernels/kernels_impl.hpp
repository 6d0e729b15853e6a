// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Included once by each kernels_<isa>.cpp after defining ORBITFUSE_LANES (floats per vector). No
// standard-library templates in here: an inline function compiled for AVX-512 could be the copy
// that the linker keeps for every processor.
#include <immintrin.h>

#include "recon/nerf/kernels/adam_impl.hpp"
#include "recon/nerf/kernels/kernels.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int lanes = ORBITFUSE_LANES;
typedef float Vec __attribute__((vector_size(ORBITFUSE_LANES * 4), aligned(4), may_alias));
typedef float Vec8 __attribute__((vector_size(32), aligned(4), may_alias));
typedef std::int32_t Int8 __attribute__((vector_size(32), aligned(4), may_alias));
typedef std::uint32_t Uint8 __attribute__((vector_size(32), aligned(4), may_alias));

inline Vec load(const float* p) { return *reinterpret_cast<const Vec*>(p); }
inline void store(float* p, Vec v) { *reinterpret_cast<Vec*>(p) = v; }

// ---- dense layers --------------------------------------------------------------------------

enum class Epilogue { store, relu, mask, add };

/// C[R][C*lanes] = sum_k A[r*rs + k*ks] * B[k][.] held in registers.
template <int R, int C, Epilogue E>
inline void tile(const float* a, long rs, long ks, const float* b, long ldb, float* c, long ldc,
                 int depth, const float* mask) {
  Vec sum[R][C];
#pragma GCC unroll 16
  for (int r = 0; r < R; ++r)
#pragma GCC unroll 16
    for (int j = 0; j < C; ++j) sum[r][j] = Vec{};
  for (int k = 0; k < depth; ++k) {
    Vec row[C];
#pragma GCC unroll 16
    for (int j = 0; j < C; ++j) row[j] = load(b + k * ldb + j * lanes);
#pragma GCC unroll 16
    for (int r = 0; r < R; ++r) {
      const Vec x = a[r * rs + k * ks] - Vec{};
#pragma GCC unroll 16
      for (int j = 0; j < C; ++j) sum[r][j] += x * row[j];
    }
  }
#pragma GCC unroll 16
  for (int r = 0; r < R; ++r)
#pragma GCC unroll 16
    for (int j = 0; j < C; ++j) {
      float* out = c + r * ldc + j * lanes;
      Vec v = sum[r][j];
      if constexpr (E == Epilogue::relu) v = v > 0 ? v : Vec{};
      if constexpr (E == Epilogue::mask) v = load(mask + (out - c)) > 0 ? v : Vec{};
      if constexpr (E == Epilogue::add) v += load(out);
      store(out, v);
    }
}

template <int R, int C, Epilogue E>
inline void rows_of_tiles(int rows, const float* a, long rs, long ks, const float* b, long ldb,
                          float* c, long ldc, int depth, const float* mask) {
  int r = 0;
  for (; r + R <= rows; r += R)
    tile<R, C, E>(a + r * rs, rs, ks, b, ldb, c + r * ldc, ldc, depth,
                  mask ? mask + r * ldc : nullptr);
  for (; r < rows; ++r)
    tile<1, C, E>(a + r * rs, rs, ks, b, ldb, c + r * ldc, ldc, depth,
                  mask ? mask + r * ldc : nullptr);
}

/// C (+)= A * B with the widest column tile that divides N.
template <Epilogue E>
inline void multiply(int rows, int columns, int depth, const float* a, long rs, long ks,
                     const float* b, float* c, const float* mask) {
  constexpr int wide = lanes == 16 ? 4 : 2;
  int n = 0;
  for (; n + wide * lanes <= columns; n += wide * lanes)
    rows_of_tiles<6, wide, E>(rows, a, rs, ks, b + n, columns, c + n, columns, depth,
                              mask ? mask + n : nullptr);
  for (; n + 2 * lanes <= columns; n += 2 * lanes)
    rows_of_tiles<(lanes == 16 ? 12 : 6), 2, E>(rows, a, rs, ks, b + n, columns, c + n, columns,
                                                depth, mask ? mask + n : nullptr);
  for (; n < columns; n += lanes)
    rows_of_tiles<(lanes == 16 ? 16 : 10), 1, E>(rows, a, rs, ks, b + n, columns, c + n, columns,
                                                 depth, mask ? mask + n : nullptr);
}

inline void forward_f32(const LayerView& layer, int rows, const float* in, float* out, bool relu) {
  if (relu)
    multiply<Epilogue::relu>(rows, layer.out, layer.in, in, layer.in, 1, layer.weights, out,
                             nullptr);
  else
    multiply<Epilogue::store>(rows, layer.out, layer.in, in, layer.in, 1, layer.weights, out,
                              nullptr);
}

inline void backward_input_f32(const LayerView& layer, int rows, const float* dout, float* din,
                               const float* activation) {
  if (activation)
    multiply<Epilogue::mask>(rows, layer.in, layer.out, dout, layer.out, 1, layer.transposed, din,
                             activation);
  else
    multiply<Epilogue::store>(rows, layer.in, layer.out, dout, layer.out, 1, layer.transposed, din,
                              nullptr);
}

inline void backward_weights_f32(const LayerView& layer, int rows, const float* in,
                                 const float* dout, float* dweights) {
  multiply<Epilogue::add>(layer.in, layer.out, rows, in, 1, layer.in, dout, dweights, nullptr);
}

// ---- hash grid -----------------------------------------------------------------------------

/// Corner entries and weights of 8 points at once.
struct Corners {
  alignas(32) std::uint32_t entry[8][8];  ///< [corner][point]; bit 0 of the corner is x
  alignas(32) float yz[4][8];             ///< weight of corner pair (y, z)
  alignas(32) float x[8];                 ///< fraction along x
};

inline void corners_of(const GridLevel& level, const float* position, int count, Corners& out) {
  alignas(32) float p[3][8];
  for (int i = 0; i < 8; ++i)
    for (int d = 0; d < 3; ++d) p[d][i] = position[3 * (i < count ? i : 0) + d];
  const float resolution = static_cast<float>(level.resolution);
  Vec8 fraction[3];
  Uint8 base[3];
  for (int d = 0; d < 3; ++d) {
    Vec8 scaled = *reinterpret_cast<Vec8*>(p[d]) * resolution;
    // Positions at the upper border belong to the last cell; anything else outside is a caller's
    // bug that must not become a wild address.
    scaled = scaled > 0 ? scaled : Vec8{};
    const Vec8 top = (resolution - 1e-3f) - Vec8{};
    scaled = scaled < top ? scaled : top;
    const Int8 cell = __builtin_convertvector(scaled, Int8);
    fraction[d] = scaled - __builtin_convertvector(cell, Vec8);
    base[d] = reinterpret_cast<const Uint8&>(cell);
  }
  Uint8 term_y[2], term_z[2];
  if (level.dense) {
    const std::uint32_t row = static_cast<std::uint32_t>(level.resolution + 1);
    term_y[0] = base[1] * row;
    term_y[1] = term_y[0] + row;
    term_z[0] = base[2] * (row * row);
    term_z[1] = term_z[0] + row * row;
  } else {
    term_y[0] = base[1] * 2654435761u;
    term_y[1] = term_y[0] + 2654435761u;
    term_z[0] = base[2] * 805459861u;
    term_z[1] = term_z[0] + 805459861u;
  }
  for (int c = 0; c < 4; ++c) {
    const int y = c & 1, z = c >> 1;
    Uint8 e0, e1;
    if (level.dense) {
      e0 = term_y[y] + term_z[z] + base[0];
      e1 = e0 + 1;
    } else {
      const Uint8 h = term_y[y] ^ term_z[z];
      e0 = (h ^ base[0]) & level.mask;
      e1 = (h ^ (base[0] + 1)) & level.mask;
    }
    *reinterpret_cast<Uint8*>(out.entry[2 * c]) = e0;
    *reinterpret_cast<Uint8*>(out.entry[2 * c + 1]) = e1;
    const Vec8 wy = y ? fraction[1] : 1.0f - fraction[1];
    const Vec8 wz = z ? fraction[2] : 1.0f - fraction[2];
    *reinterpret_cast<Vec8*>(out.yz[c]) = wy * wz;
  }
  *reinterpret_cast<Vec8*>(out.x) = fraction[0];
}

inline void encode_point4(const Corners& corners, int i, const std::uint16_t* table, float* out) {
  __m256 sum = _mm256_setzero_ps();  // low half: x corners 0, high half: x corners 1
  for (int c = 0; c < 4; ++c) {
    const __m128i low =
        _mm_loadl_epi64(reinterpret_cast<const __m128i*>(table + 4ul * corners.entry[2 * c][i]));
    const __m128i both = _mm_castps_si128(
        _mm_loadh_pi(_mm_castsi128_ps(low),
                     reinterpret_cast<const __m64*>(table + 4ul * corners.entry[2 * c + 1][i])));
    sum = _mm256_fmadd_ps(_mm256_cvtph_ps(both), _mm256_broadcast_ss(&corners.yz[c][i]), sum);
  }
  const __m128 x0 = _mm256_castps256_ps128(sum), x1 = _mm256_extractf128_ps(sum, 1);
  _mm_storeu_ps(out, _mm_fmadd_ps(_mm_sub_ps(x1, x0), _mm_broadcast_ss(&corners.x[i]), x0));
}

inline void encode_point2(const Corners& corners, int i, const std::uint16_t* table, float* out) {
  __m128 sum = _mm_setzero_ps();
  for (int c = 0; c < 4; ++c) {
    const __m128i both =
        _mm_unpacklo_epi32(_mm_loadu_si32(table + 2ul * corners.entry[2 * c][i]),
                           _mm_loadu_si32(table + 2ul * corners.entry[2 * c + 1][i]));
    sum = _mm_fmadd_ps(_mm_cvtph_ps(both), _mm_broadcast_ss(&corners.yz[c][i]), sum);
  }
  const __m128 x1 = _mm_movehl_ps(sum, sum);
  _mm_storel_pi(reinterpret_cast<__m64*>(out),
                _mm_fmadd_ps(_mm_sub_ps(x1, sum), _mm_broadcast_ss(&corners.x[i]), sum));
}

/// Points are looked up in groups of 8: while one group's corners are read, the next one's are on
/// their way from memory. A table that fits into the L2 cache with the others' gains nothing.
constexpr unsigned long prefetched_from = 1ul << 19;  ///< bytes

/// visit(corners, begin, n) for each group in turn; an entry is `entry_bytes` of `table`.
template <typename Visit>
inline void visit_groups(const GridLevel& level, const void* table, unsigned long entry_bytes,
                         const float* position, int count, const Visit& visit) {
  const bool ahead = level.entries * entry_bytes >= prefetched_from;
  Corners corners[2];
  const auto look_up = [&](int begin, Corners& group) {
    const int n = count - begin < 8 ? count - begin : 8;
    corners_of(level, position + 3l * begin, n, group);
  };
  if (ahead && count > 0) look_up(0, corners[0]);
  int turn = 0;
  for (int begin = 0; begin < count; begin += 8) {
    if (!ahead) {
      look_up(begin, corners[0]);
    } else if (begin + 8 < count) {
      Corners& next = corners[turn ^ 1];
      look_up(begin + 8, next);
      for (int c = 0; c < 8; ++c)
        for (int i = 0; i < 8; ++i)
          _mm_prefetch(static_cast<const char*>(table) + entry_bytes * next.entry[c][i],
                       _MM_HINT_T0);
    }
    visit(corners[turn], begin, count - begin < 8 ? count - begin : 8);
    if (ahead) turn ^= 1;
  }
}

inline void encode_grid(const GridLevel& level, const std::uint16_t* table, const float* position,
                        int count, float* out, int stride) {
  const unsigned long bytes = sizeof(std::uint16_t) * static_cast<unsigned long>(level.features);
  visit_groups(level, table, bytes, position, count, [&](const Corners& corners, int begin, int n) {
    float* row = out + static_cast<long>(begin) * stride;
    if (level.features == 4)
      for (int i = 0; i < n; ++i)
        encode_point4(corners, i, table, row + static_cast<long>(i) * stride);
    else
      for (int i = 0; i < n; ++i)
        encode_point2(corners, i, table, row + static_cast<long>(i) * stride);
  });
}

/// Where a level's gradients go.
struct LineGradients {
  GridLine* lines;
  std::uint64_t* touched;
  float* touch(std::uint32_t line) const {
    touched[line >> 6] |= std::uint64_t{1} << (line & 63u);
    return lines[line].grad;
  }
};

inline void scatter_point4(const Corners& corners, int i, __m128 d, const LineGradients& out) {
  const __m128 d1 = _mm_mul_ps(d, _mm_broadcast_ss(&corners.x[i]));
  const __m128 d0 = _mm_sub_ps(d, d1);
  for (int c = 0; c < 4; ++c) {
    const __m128 w = _mm_broadcast_ss(&corners.yz[c][i]);
    float* g0 = out.touch(corners.entry[2 * c][i]);
    _mm_store_ps(g0, _mm_fmadd_ps(d0, w, _mm_load_ps(g0)));
    float* g1 = out.touch(corners.entry[2 * c + 1][i]);
    _mm_store_ps(g1, _mm_fmadd_ps(d1, w, _mm_load_ps(g1)));
  }
}

inline void scatter_point2(const Corners& corners, int i, __m128 d, const LineGradients& out) {
  const __m128 d1 = _mm_mul_ps(d, _mm_broadcast_ss(&corners.x[i]));
  const __m128 d0 = _mm_sub_ps(d, d1);
  for (int c = 0; c < 8; ++c) {
    const std::uint32_t entry = corners.entry[c][i];
    float* g = out.touch(entry / 2) + 2 * (entry % 2);
    const __m128 old = _mm_castsi128_ps(_mm_loadl_epi64(reinterpret_cast<__m128i*>(g)));
    _mm_storel_pi(reinterpret_cast<__m64*>(g),
                  _mm_fmadd_ps(c & 1 ? d1 : d0, _mm_broadcast_ss(&corners.yz[c >> 1][i]), old));
  }
}

inline void scatter_grid(const GridLevel& level, GridLine* lines, std::uint64_t* touched,
                         const float* position, int count, const float* dfeatures) {
  const unsigned long bytes = sizeof(GridLine) / 4 * static_cast<unsigned long>(level.features);
  const LineGradients out{lines, touched};
  visit_groups(level, lines, bytes, position, count, [&](const Corners& corners, int begin, int n) {
    if (level.features == 4)
      for (int i = 0; i < n; ++i)
        scatter_point4(corners, i, _mm_loadu_ps(dfeatures + 4l * (begin + i)), out);
    else
      for (int i = 0; i < n; ++i)
        scatter_point2(corners, i,
                       _mm_castsi128_ps(_mm_loadl_epi64(
                           reinterpret_cast<const __m128i*>(dfeatures + 2l * (begin + i)))),
                       out);
  });
}

}  // namespace
}  // namespace orbitfuse::nerf
