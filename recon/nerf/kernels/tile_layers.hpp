// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "recon/nerf/kernels/kernels.hpp"

// Layers over matrix tiles (Intel SDM volume 1, "Programming with Intel AMX"), with bf16 operands
// and fp32 sums. The tiles and the rounding are policies, so that what runs on a processor with AMX
// is tested on any. No standard-library templates in here (see kernels_impl.hpp).
namespace orbitfuse::nerf {
namespace {

/// What LDTILECFG reads: the shapes of 8 tiles of at most 16 rows of 64 bytes.
struct alignas(64) TileConfig {
  std::uint8_t palette = 1, start_row = 0, reserved[14] = {};
  std::uint16_t row_bytes[16] = {};
  std::uint8_t rows[16] = {};
};
static_assert(sizeof(TileConfig) == 64);

/// Tiles 0..3 are sums of 16 x 16 floats, 4 and 5 left operands (16 rows of pairs of bf16), 6 and 7
/// right ones (a row of 16 pairs for each pair of the left).
constexpr int first_left = 4, first_right = 6;

/// `Tiles` configures the tiles when constructed and releases them when destroyed:
///   Tiles(const TileConfig&), zero<T>(), load<T>(base, bytes between rows), store<T>(base, bytes),
///   multiply_add<Sum, Left, Right>()
/// `Rounding`: as Avx512Rounding.
template <class Tiles, class Rounding>
class TileLayers {
 public:
  static constexpr int max_width = 256;

  static void forward(const LayerView& layer, int rows, const float* in, float* out, bool relu) {
    if (relu)
      product<After::relu>(layer.in, layer.out, rows, in, layer.paired, out, nullptr);
    else
      product<After::nothing>(layer.in, layer.out, rows, in, layer.paired, out, nullptr);
  }

  static void backward_input(const LayerView& layer, int rows, const float* dout, float* din,
                             const float* activation) {
    if (activation)
      product<After::mask>(layer.out, layer.in, rows, dout, layer.paired_t, din, activation);
    else
      product<After::nothing>(layer.out, layer.in, rows, dout, layer.paired_t, din, nullptr);
  }

  static void backward_weights(const LayerView& layer, int rows, const float* in, const float* dout,
                               float* dweights) {
    constexpr int chunk = 128;
    alignas(64) std::uint16_t left[chunk * max_width], right[chunk * max_width];
    const int columns = layer.out;
    Tiles tiles(shapes(16));
    for (int begin = 0; begin < rows; begin += chunk) {
      const int n = rows - begin < chunk ? rows - begin : chunk;
      Rounding::transpose(in + static_cast<long>(begin) * layer.in, n, layer.in, chunk, left);
      Rounding::pair_rows(dout + static_cast<long>(begin) * columns, n, columns, right);
      const int steps = (n + 31) / 32;
      for (long k = long{n + n % 2} * columns; k < 32l * steps * columns; ++k) right[k] = 0;
      for (int j = 0; j < columns; j += 32)
        for (int i = 0; i < layer.in; i += 32) {
          const Operand a{left + static_cast<long>(i) * chunk, chunk, 32};
          const Operand b{right + 2l * j, 2l * columns, 32l * columns};
          float* c = dweights + static_cast<long>(i) * columns + j;
          const bool two_rows = layer.in - i > 16, two_columns = columns - j > 16;
          if (two_rows && two_columns)
            add_products<2, 2>(tiles, a, b, steps, c, columns);
          else if (two_rows)
            add_products<2, 1>(tiles, a, b, steps, c, columns);
          else if (two_columns)
            add_products<1, 2>(tiles, a, b, steps, c, columns);
          else
            add_products<1, 1>(tiles, a, b, steps, c, columns);
        }
    }
  }

 private:
  typedef float Vec __attribute__((vector_size(64), aligned(4), may_alias));
  enum class After { nothing, relu, mask };

  /// bf16 values; the rows of a tile are `row` apart, the tiles that are summed over `step`.
  struct Operand {
    const std::uint16_t* first;
    long row, step;
  };

  static TileConfig shapes(int pairs) {
    TileConfig config;
    for (int t = 0; t < 8; ++t) {
      const bool left = t == 4 || t == 5, right = t >= first_right;
      config.row_bytes[t] = static_cast<std::uint16_t>(left ? 4 * pairs : 64);
      config.rows[t] = static_cast<std::uint8_t>(right ? pairs : 16);
    }
    return config;
  }

  /// M x N sums (tile 2m + n) += left (M tiles below each other) * right (N tiles side by side).
  template <int M, int N>
  static void sum(Tiles& t, Operand left, Operand right, int steps) {
    constexpr int l = first_left, r = first_right;
    for (int k = 0; k < steps; ++k) {
      const std::uint16_t *a = left.first + k * left.step, *b = right.first + k * right.step;
      t.template load<l>(a, 2 * left.row);
      if constexpr (M == 2) t.template load<l + 1>(a + 16 * left.row, 2 * left.row);
      t.template load<r>(b, 2 * right.row);
      if constexpr (N == 2) t.template load<r + 1>(b + 32, 2 * right.row);
      t.template multiply_add<0, l, r>();
      if constexpr (N == 2) t.template multiply_add<1, l, r + 1>();
      if constexpr (M == 2) t.template multiply_add<2, l + 1, r>();
      if constexpr (M == 2 && N == 2) t.template multiply_add<3, l + 1, r + 1>();
    }
  }

  template <int M, int N>
  static void store(Tiles& t, float* c, long row_bytes) {
    t.template store<0>(c, row_bytes);
    if constexpr (N == 2) t.template store<1>(c + 16, row_bytes);
    float* below = c + 16 * row_bytes / 4;
    if constexpr (M == 2) t.template store<2>(below, row_bytes);
    if constexpr (M == 2 && N == 2) t.template store<3>(below + 16, row_bytes);
  }

  template <int M, int N>
  static void add_products(Tiles& t, Operand left, Operand right, int steps, float* c,
                           long columns) {
    const float* below = c + 16 * columns;
    t.template load<0>(c, 4 * columns);
    if constexpr (N == 2) t.template load<1>(c + 16, 4 * columns);
    if constexpr (M == 2) t.template load<2>(below, 4 * columns);
    if constexpr (M == 2 && N == 2) t.template load<3>(below + 16, 4 * columns);
    sum<M, N>(t, left, right, steps);
    store<M, N>(t, c, 4 * columns);
  }

  /// out[rows][columns] = in[rows][depth] * weights (bf16 [depth/2][columns][2]), 32 rows at a
  /// time, so that each row is rounded once.
  template <After A>
  static void product(int depth, int columns, int rows, const float* in,
                      const std::uint16_t* weights, float* out, const float* mask) {
    alignas(64) std::uint16_t a[32 * max_width];
    const int step = depth % 32 == 0 ? 32 : 16;
    Tiles tiles(shapes(step / 2));
    for (int r = 0; r < rows; r += 32) {
      const int n = rows - r < 32 ? rows - r : 32;
      Rounding::in_order(in + static_cast<long>(r) * depth, n * depth, a);
      for (int k = n * depth; k < (n > 16 ? 32 : 16) * depth; ++k) a[k] = 0;
      for (int j = 0; j < columns; j += 32) {
        const Operand left{a, depth, step};
        const Operand right{weights + 2l * j, 2l * columns, static_cast<long>(step) * columns};
        const long at = static_cast<long>(r) * columns + j;
        const float* m = mask ? mask + at : nullptr;
        const bool two_columns = columns - j > 16;
        if (n > 16 && two_columns)
          product_block<2, 2, A>(tiles, left, right, depth / step, n, out + at, columns, m);
        else if (n > 16)
          product_block<2, 1, A>(tiles, left, right, depth / step, n, out + at, columns, m);
        else if (two_columns)
          product_block<1, 2, A>(tiles, left, right, depth / step, n, out + at, columns, m);
        else
          product_block<1, 1, A>(tiles, left, right, depth / step, n, out + at, columns, m);
      }
    }
  }

  template <int M, int N, After A>
  static void product_block(Tiles& t, Operand left, Operand right, int steps, int rows, float* out,
                            long columns, const float* mask) {
    alignas(64) float sums[16 * M][16 * N];
    t.template zero<0>();
    if constexpr (N == 2) t.template zero<1>();
    if constexpr (M == 2) t.template zero<2>();
    if constexpr (M == 2 && N == 2) t.template zero<3>();
    sum<M, N>(t, left, right, steps);
    store<M, N>(t, sums[0], 64 * N);
    for (int r = 0; r < rows; ++r)
      for (int j = 0; j < 16 * N; j += 16) {
        Vec v = *reinterpret_cast<const Vec*>(&sums[r][j]);
        if constexpr (A == After::relu) v = v > 0 ? v : Vec{};
        if constexpr (A == After::mask)
          v = *reinterpret_cast<const Vec*>(mask + r * columns + j) > 0 ? v : Vec{};
        *reinterpret_cast<Vec*>(out + r * columns + j) = v;
      }
  }
};

}  // namespace
}  // namespace orbitfuse::nerf
